//! Tests of the protocol table.

use super::*;
use std::collections::BTreeSet;

/// Parses an address on one of the two sides.
type Read = fn(&str) -> Result<CheckedAddress, LinkError>;

/// Returns the parsers of a row's addresses.
fn readers(row: &ProtocolRow) -> Vec<Read> {
    let readers: [(bool, Read); 4] = [
        (row.robot.is_some(), CheckedAddress::robot),
        (row.sensor.is_some(), CheckedAddress::sensor),
        (row.emulated_robot.is_some(), CheckedAddress::emulated_robot),
        (row.emulated_sensor.is_some(), CheckedAddress::emulated_sensor),
    ];
    readers.into_iter().filter(|(has, _)| *has).map(|(_, read)| read).collect()
}

#[test]
fn every_scheme_parses_and_refuses_unknown_options() {
    for row in PROTOCOLS {
        assert!(!readers(row).is_empty(), "{} has neither robot nor sensor", row.scheme);
        for read in readers(row) {
            let checked = read(&format!("{}://127.0.0.1", row.scheme)).expect("an address");
            assert_eq!(checked.row().scheme, row.scheme);
            let refused = read(&format!("{}://127.0.0.1?spin=3", row.scheme)).expect_err("no such option");
            assert!(refused.to_string().contains("has no option `spin`"), "{refused}");
            let remedy = refused.remedy().expect("a remedy");
            let known = row.options.iter().filter(|option| !option.ours_only);
            known.for_each(|option| assert!(remedy.contains(option.key), "{}: {remedy}", row.scheme));
        }
    }
}

#[test]
fn unknown_scheme_is_refused_with_a_list_of_known_ones() {
    let remedy = |refused: Result<CheckedAddress, LinkError>| {
        let refused = refused.expect_err("no such protocol");
        assert!(refused.to_string().starts_with("`modbus://` is not a "), "{refused}");
        refused.remedy().expect("a remedy").to_owned()
    };
    let address = "modbus://127.0.0.1";
    let robots = "robot protocols are rsi://, egm://, fanuc://, ethercat:// or are emulated://";
    assert_eq!(remedy(CheckedAddress::robot(address)), robots);
    assert_eq!(remedy(CheckedAddress::sensor(address)), "sensor protocols are netft:// or are emulated://");
    assert_eq!(remedy(CheckedAddress::emulated_robot(address)), "write rsi://, egm:// or fanuc://");
    assert_eq!(remedy(CheckedAddress::emulated_sensor(address)), "write netft://");
}

#[test]
fn rows_are_complete_and_their_help_shows_the_defaults() {
    let schemes: BTreeSet<&str> = PROTOCOLS.iter().map(|row| row.scheme).collect();
    assert_eq!(schemes.len(), PROTOCOLS.len(), "schemes are unique");
    for row in PROTOCOLS {
        let is_robot = row.robot.is_some();
        assert_eq!(row.option("cycle_ms").is_some(), is_robot, "{}: robots have a cycle", row.scheme);
        assert!(!row.usage.is_empty(), "{}", row.scheme);
        let is_emulated = row.emulated_robot.is_some() || row.emulated_sensor.is_some();
        assert_eq!(!row.emulated_usage.is_empty(), is_emulated, "{}", row.scheme);
        let lines = row.usage_lines();
        for line in lines.iter().chain(&row.emulated_usage_lines()) {
            assert!(line.starts_with(&format!("{}://", row.scheme)) && !line.contains('{'), "{line}");
        }
        for option in row.options.iter().filter_map(|option| Some((option.key, option.default?))) {
            let shown = format!("{}={}", option.0, option.1);
            assert!(lines.iter().any(|line| line.contains(&shown)), "{}: {shown} is not in its help", row.scheme);
        }
    }
}

#[test]
fn cycle_comes_from_the_address_or_the_protocol() {
    for (address, millis) in [
        ("emulated://", 1),
        ("ethercat://eth0", 1),
        ("fanuc://127.0.0.1", 8),
        ("rsi://127.0.0.1", 4),
        ("egm://127.0.0.1", 4),
        ("rsi://127.0.0.1?cycle_ms=12", 12),
    ] {
        let cycle = CheckedAddress::robot(address).and_then(|checked| checked.cycle()).expect("a cycle");
        assert_eq!(cycle, Nanos::from_millis(millis), "{address}");
    }
}

#[test]
fn calling_controller_is_armed_only_if_its_host_is_known() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../campaigns/facilities/reference.toml");
    let mut station = Station::load(std::path::Path::new(path)).expect("the facility");
    let all = |robot: &str| {
        let [one, two] = [robot, "emulated://"].map(|text| CheckedAddress::robot(text).expect("an address"));
        [one, two, CheckedAddress::sensor("emulated://").expect("an address")]
    };
    station.robots[0].address = None;
    let refused = check_arming(&all("emulated://"), &station).expect_err("nothing is real").to_string();
    assert!(refused.contains("all links are emulated"), "{refused}");
    let refused = check_arming(&all("rsi://0.0.0.0"), &station).expect_err("no host is named").to_string();
    assert!(
        refused.contains("robot 1 has no controller address: any host on the network could answer first"),
        "{refused}"
    );
    assert!(check_arming(&all("rsi://0.0.0.0?from=10.0.0.7"), &station).is_ok());
    assert!(check_arming(&all("fanuc://10.0.0.7"), &station).is_ok());
    // A network interface names no host.
    station.robots[0].address = Some("eth0".to_owned());
    assert!(check_arming(&all("egm://0.0.0.0"), &station).is_err());
    station.robots[0].address = Some("10.0.0.7".to_owned());
    assert!(check_arming(&all("egm://0.0.0.0"), &station).is_ok());
}
