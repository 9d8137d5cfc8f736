//! The three addresses of a facility, and the links that are opened at them.

use crate::error::Result;
use softdock_campaign::Station;
use softdock_realtime::clock::{Clock, Monotonic, Virtual};
use softdock_realtime::emulation::in_process::{InProcessRig, links};
use softdock_realtime::emulation::world::World;
use softdock_realtime::links::{CheckedAddress, LinkContext, LinkNotice, Reporter};
use softdock_realtime::signals::Links;
use softdock_realtime::time::Nanos;
use std::cell::RefCell;
use std::rc::Rc;

/// The addresses of both robots and of the sensor.
#[derive(Clone, Debug)]
pub struct FacilityAddresses {
    all: [CheckedAddress; 3],
}

/// Links that receive the commands, and real links that a dry run only exercises.
pub(crate) struct OpenedLinks {
    pub(crate) moved: Links,
    pub(crate) exercised: Option<Links>,
}

impl FacilityAddresses {
    /// Parses the addresses of robot 1, robot 2 and the sensor.
    ///
    /// # Errors
    /// If one of them is no address of its device's protocols.
    pub fn parse(robots: [&str; 2], sensor: &str) -> Result<Self> {
        let [one, two] = robots.map(CheckedAddress::robot);
        Ok(Self { all: [one?, two?, CheckedAddress::sensor(sensor)?] })
    }

    /// Returns robot 1, robot 2, sensor.
    pub fn all(&self) -> &[CheckedAddress; 3] {
        &self.all
    }

    /// Returns the real links, as `scheme://place`.
    pub fn real(&self) -> Vec<String> {
        self.all.iter().filter(|address| address.is_real()).map(CheckedAddress::shown).collect()
    }

    /// Whether any link is real.
    pub fn any_real(&self) -> bool {
        self.all.iter().any(CheckedAddress::is_real)
    }

    /// Returns the cycle of robot 1, the clock master of the session.
    ///
    /// # Errors
    /// If the address states an invalid cycle.
    pub fn cycle(&self) -> Result<Nanos> {
        Ok(self.all[0].cycle()?)
    }

    /// Returns the configuration files of the robots' controllers for these addresses: names and texts.
    ///
    /// # Errors
    /// If an address lacks an option that its configuration needs.
    pub fn configurations(&self, station: &Station, report: &dyn Fn(LinkNotice)) -> Result<Vec<(String, String)>> {
        let mut files = Vec::new();
        for (index, address) in self.all[..2].iter().enumerate() {
            if let Some((name, text)) = address.configuration(station.rail && index == 0, report)? {
                files.push((format!("robot{}_{name}", index + 1), text));
            }
        }
        Ok(files)
    }

    /// Opens all links of a session.
    ///
    /// Emulated robots and sensors are part of `world` with its clock `clock`; in a dry run with real links they have a
    /// virtual clock.
    pub(crate) fn open(
        &self,
        armed: bool,
        station: &Station,
        world: impl Fn() -> Result<World>,
        clock: Rc<dyn Clock>,
        report: Reporter,
    ) -> Result<OpenedLinks> {
        let cycle = self.cycle()?;
        if !self.any_real() {
            let bench = InProcessRig::new(world()?, clock, cycle);
            let moved = self.linked(&LinkContext { armed, station, bench: Some(&bench), report })?;
            return Ok(OpenedLinks { moved, exercised: None });
        }
        let any_emulated = self.all.iter().any(|address| !address.is_real());
        let bench: Option<Rc<RefCell<InProcessRig>>> =
            if any_emulated { Some(InProcessRig::new(world()?, Rc::new(Monotonic), cycle)) } else { None };
        let real = self.linked(&LinkContext { armed, station, bench: bench.as_ref(), report })?;
        if armed {
            return Ok(OpenedLinks { moved: real, exercised: None });
        }
        let shadow = InProcessRig::new(world()?, Rc::new(Virtual::default()), cycle);
        Ok(OpenedLinks { moved: links(&shadow), exercised: Some(real) })
    }

    /// Opens the sensor first, and last the robots whose devices need frames from then on.
    fn linked(&self, context: &LinkContext) -> Result<Links> {
        let [one, two, ft] = &self.all;
        let sensor = ft.open_sensor(context)?;
        let robots = if one.row().opens_last && !two.row().opens_last {
            let second = two.open_robot(1, context)?;
            [one.open_robot(0, context)?, second]
        } else {
            [one.open_robot(0, context)?, two.open_robot(1, context)?]
        };
        Ok(Links { robots, sensor })
    }
}
