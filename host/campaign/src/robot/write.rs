//! A robot as the text of a model file: SI, every number with all its digits, read back to the same bits.

use super::{FORMAT, Robot};
use softdock_kernels::manipulator::Joint;
use softdock_kernels::vector::{Sym3, Vec3};
use std::fmt::Write;

impl Robot {
    /// The model file; `remarks` stand as comments at its head.
    ///
    /// Columns of recordings keep their units' factor as a scale, so that the map is the same without the unit.
    pub fn to_toml(&self, remarks: &[String]) -> String {
        let mut out = String::new();
        for remark in remarks {
            let _ = writeln!(out, "# {}", remark.replace('\n', " "));
        }
        let _ = writeln!(out, "\nschema = {:?}\nid = {:?}\ntitle = {}", FORMAT, self.id, text(&self.title));
        let w = &self.model.workspace;
        let _ = writeln!(
            out,
            "\n[workspace]\nreach = \"{} m\"\npayload = \"{} kg\"\nrepeatability = \"{} m\"\nsource = {}",
            w.reach,
            w.payload,
            w.repeatability,
            text(&self.workspace_source)
        );
        for index in 0..self.joints.len() {
            self.joint(&mut out, index);
        }
        for (capsule, source) in self.model.capsules.iter().zip(&self.capsule_sources) {
            let point = |p: Vec3<f64>| format!("[\"{} m\", \"{} m\", \"{} m\"]", p.x, p.y, p.z);
            let _ = writeln!(
                out,
                "\n[[capsule]]\njoint = {}\nfrom = {}\nto = {}\nradius = \"{} m\"\nsource = {}",
                capsule.joint + 1,
                point(capsule.axis.from),
                point(capsule.axis.to),
                capsule.radius,
                text(source)
            );
        }
        if !self.log.is_empty() {
            let _ = writeln!(out, "\n[log]");
        }
        for channel in &self.log {
            let si = super::SIGNALS.iter().find(|row| row.1 == channel.signal.quantity).map_or("1", |row| row.2);
            let _ = writeln!(
                out,
                "{:?} = {{ column = {}, unit = {si:?}, scale = {:?}, offset = \"{} {si}\" }}",
                channel.name,
                text(&channel.column.name),
                channel.column.factor,
                channel.column.offset
            );
        }
        out
    }

    fn joint(&self, out: &mut String, index: usize) {
        let (facts, joint) = (&self.joints[index], &self.model.joints[index]);
        let (row, sources) = (&facts.row, &facts.sources);
        let _ = writeln!(out, "\n[[joint]]\nname = {}", text(&facts.name));
        let _ = writeln!(
            out,
            "[joint.kinematics]\na = \"{} m\"\nalpha = \"{} rad\"\nd = \"{} m\"\noffset = \"{} rad\"\nsign = {}\nsource = {}",
            row.a,
            row.alpha,
            row.d,
            row.offset,
            row.sign,
            text(&sources.kinematics)
        );
        let (link, i): (_, Sym3<f64>) = (&joint.link, joint.link.inertia);
        let _ = writeln!(
            out,
            "[joint.link]\nmass = \"{} kg\"\ncom = [\"{} m\", \"{} m\", \"{} m\"]",
            link.mass, link.com.x, link.com.y, link.com.z
        );
        let moments = [("ixx", i.xx), ("iyy", i.yy), ("izz", i.zz), ("ixy", i.xy), ("ixz", i.xz), ("iyz", i.yz)];
        let moments = moments.map(|(name, value)| format!("{name} = \"{value} kg m^2\"")).join(", ");
        let _ = writeln!(out, "inertia = {{ {moments} }}\nsource = {}", text(&sources.link));
        drive_and_friction(out, joint, &sources.drive, &sources.friction);
        if let Some(c) = &joint.counterweight {
            let source = text(&sources.counterweight);
            let _ = writeln!(
                out,
                "[joint.counterweight]\ntorque = \"{} N m\"\nangle = \"{} rad\"\nsource = {source}",
                c.torque, c.angle
            );
        }
        let l = &joint.limits;
        let _ = writeln!(
            out,
            "[joint.limits]\nlower = \"{} rad\"\nupper = \"{} rad\"\nspeed = \"{} rad/s\"\nacceleration = \"{} rad/s^2\"\nsource = {}",
            l.lower,
            l.upper,
            l.speed,
            l.acceleration,
            text(&sources.limits)
        );
    }
}

fn drive_and_friction(out: &mut String, joint: &Joint, drive_source: &str, friction_source: &str) {
    let (d, f) = (&joint.drive, &joint.friction);
    let rows = [
        ("gear_ratio", d.gear_ratio, ""),
        ("rotor_inertia", d.rotor_inertia, "kg m^2"),
        ("gear_stiffness", d.gear_stiffness, "N m/rad"),
        ("gear_damping", d.gear_damping, "N m s/rad"),
        ("backlash", d.backlash, "rad"),
        ("torque_offset", d.torque_offset, "N m"),
        ("torque_limit", d.torque_limit, "N m"),
        ("static_torque", d.static_torque, "N m"),
    ];
    table(out, "[joint.drive]", &rows, drive_source);
    let rows = [
        ("coulomb", f.coulomb, "N m"),
        ("viscous", f.viscous, "N m s/rad"),
        ("stribeck", f.stribeck, "N m"),
        ("stribeck_speed", f.stribeck_speed, "rad/s"),
        ("presliding_stiffness", f.presliding_stiffness, "N m/rad"),
        ("load_coefficient", f.load_coefficient, ""),
    ];
    table(out, "[joint.friction]", &rows, friction_source);
}

fn table(out: &mut String, header: &str, rows: &[(&str, f64, &str)], source: &str) {
    let _ = writeln!(out, "{header}");
    for (key, value, unit) in rows {
        let _ = match *unit {
            "" => writeln!(out, "{key} = {value:?}"),
            unit => writeln!(out, "{key} = \"{value} {unit}\""),
        };
    }
    let _ = writeln!(out, "source = {}", text(source));
}

/// A TOML string.
fn text(value: &str) -> String {
    let escaped: String = value
        .chars()
        .map(|c| match c {
            '"' => "\\\"".to_owned(),
            '\\' => "\\\\".to_owned(),
            '\n' => "\\n".to_owned(),
            c if c.is_control() => " ".to_owned(),
            c => c.to_string(),
        })
        .collect();
    format!("\"{escaped}\"")
}
