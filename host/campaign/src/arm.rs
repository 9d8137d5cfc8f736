//! The arm from its URDF: the chain from the base to part A, every link turned so that its joint axis is its z axis.
//!
//! Joints off that chain are held, and what they carry is merged into the link that carries them.

use crate::check::from_roll_pitch_yaw;
use crate::inertia::{Joined, fault};
use crate::problem::Problem;
use crate::source::Source;
use softdock_kernels::model::{Link, MAX_JOINTS, joint_motion};
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use urdf_rs::{Joint, JointType, Robot};

/// Most links, and most joints, of a URDF.
const MOST_LINKS: usize = 1000;

/// What to do about a text that is no URDF.
const CLOSED: &str = "check that every element is closed and that links have <inertial> with <mass> and <inertia>";

/// Treatment of a mass of the root link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BaseMass {
    /// The scenario states the base's mass.
    Refused,
    /// The base stands still. Fingers of a gripper are fixed at their zero.
    Ignored,
    /// The base is held: nothing depends on its mass.
    Held,
}

/// What a scenario states of an arm besides its URDF.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stated<'a> {
    /// Link that carries part A; none: the last one of the only chain.
    pub(crate) end: Option<&'a str>,
    /// Places at which joints off the chain are held \[rad, m\]; the others are held at 0.
    pub(crate) held: Option<&'a BTreeMap<String, f64>>,
}

/// A joint that is held.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeldJoint {
    /// Name of the joint.
    pub(crate) name: String,
    /// Whether it slides.
    pub(crate) slides: bool,
    /// Its limits \[rad, m\].
    pub(crate) limits: (f64, f64),
    /// Where it is held \[rad, m\].
    pub(crate) place: f64,
    /// Mass of all that it carries \[kg\].
    pub(crate) mass: f64,
    /// The link, or the root, that carries it, by the name of its first URDF link.
    pub(crate) carrier: String,
}

/// What a URDF states of a joint's drive; none where it states nothing, or 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JointRating {
    /// Greatest torque \[N m\], or force of a joint that slides \[N\].
    pub(crate) effort: Option<f64>,
    /// Greatest speed \[rad/s, m/s\].
    pub(crate) velocity: Option<f64>,
    /// Viscous friction \[N m s/rad, N s/m\].
    pub(crate) damping: Option<f64>,
    /// Coulomb friction \[N m, N\].
    pub(crate) friction: Option<f64>,
}

/// A checked arm.
#[derive(Clone, Debug)]
pub(crate) struct Arm {
    /// Moving links from the base outwards.
    pub(crate) links: Vec<Link>,
    /// Names of their joints.
    pub(crate) joints: Vec<String>,
    /// Which of them slide.
    pub(crate) slides: Vec<bool>,
    /// Limits of the joints \[rad, m\].
    pub(crate) limits: Vec<(f64, f64)>,
    /// Joints off the chain.
    pub(crate) held: Vec<HeldJoint>,
    /// What they add to the base, in the base's body frame.
    pub(crate) on_base: Joined,
    /// What the URDF states of their drives.
    pub(crate) ratings: Vec<JointRating>,
    /// Every URDF link: number of moving joints before it, and its pose in that moving link's frame.
    frames: HashMap<String, (usize, Pose<f64>)>,
    /// Name of the last moving link, or of the root.
    last: String,
}

impl Arm {
    /// Pose of a URDF link (default: the last moving one) in the last moving link's frame of the model.
    pub(crate) fn frame(&self, link: Option<&str>) -> Result<Pose<f64>, String> {
        let name = link.unwrap_or(&self.last);
        match self.frames.get(name) {
            Some((body, pose)) if *body == self.links.len() && (*body > 0 || self.held.is_empty()) => Ok(*pose),
            Some(_) => Err(format!("no joint of the arm moves link `{name}`, and part A must be on a link that moves")),
            None => Err(format!("the URDF has no link `{name}`")),
        }
    }
}

/// Reads the chain; `mount` is the root link's pose in the base's body frame.
pub(crate) fn read(source: &Source, mount: Pose<f64>, base: BaseMass, stated: Stated<'_>) -> Result<Arm, Vec<Problem>> {
    if let Err(deep) = softdock_input::xml_depth(source.text()) {
        let expected = format!("at most {} levels", softdock_input::MAX_DEPTH);
        let problem = Problem::at(source, deep.offset..deep.offset + 1, format!("this is not a URDF: {deep}"));
        return Err(vec![problem.key("robot").value("").expected(expected).remedy(CLOSED)]);
    }
    let mut robot = urdf_rs::read_from_string(source.text()).map_err(|error| {
        let end = source.text().trim_end().len();
        let message =
            format!("this is not a URDF: {}", error.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
        let start = source.text()[..end].char_indices().next_back().map_or(0, |(at, _)| at);
        vec![Problem::at(source, start..end, message).key("robot").value("").remedy(CLOSED)]
    })?;
    for (kind, count) in [("link", robot.links.len()), ("joint", robot.joints.len())] {
        if count > MOST_LINKS {
            let message = format!("the URDF has {count} {kind}s");
            let problem = Problem::at(source, 0..0, message).key("robot").value("");
            let remedy = "keep the chain from the base to the end-effector, and remove the rest of the scene";
            return Err(vec![problem.expected(format!("at most {MOST_LINKS}")).remedy(remedy)]);
        }
    }
    if base == BaseMass::Ignored {
        let grippers: Vec<usize> = grippers(&robot).collect();
        grippers.into_iter().for_each(|joint| robot.joints[joint].joint_type = JointType::Fixed);
    }
    let mut reader = Reader { source, robot: &robot, base, stated, moving: HashSet::new(), problems: Vec::new() };
    reader.check_numbers();
    let arm = if reader.problems.is_empty() { reader.chain(mount) } else { None };
    match arm {
        Some(arm) if reader.problems.is_empty() => Ok(arm),
        _ => Err(reader.problems),
    }
}

/// Prismatic joints beyond which nothing turns, such as fingers: their numbers in the URDF.
pub(crate) fn grippers(robot: &Robot) -> impl Iterator<Item = usize> {
    let turns = |joint: &Joint| matches!(joint.joint_type, JointType::Revolute | JointType::Continuous);
    let is_gripper = move |joint: &Joint| {
        let (mut open, mut seen) = (vec![&joint.child.link], 0);
        while let Some(link) = open.pop() {
            seen += 1;
            let mut beyond = robot.joints.iter().filter(|joint| joint.parent.link == *link);
            // A loop is reported by the chain's reader.
            if seen > robot.joints.len() || beyond.clone().any(turns) {
                return false;
            }
            open.extend(beyond.by_ref().map(|joint| &joint.child.link));
        }
        joint.joint_type == JointType::Prismatic
    };
    (0..robot.joints.len()).filter(move |number| is_gripper(&robot.joints[*number]))
}

struct Reader<'a> {
    source: &'a Source,
    robot: &'a Robot,
    base: BaseMass,
    stated: Stated<'a>,
    /// Names of the joints of the chain.
    moving: HashSet<String>,
    problems: Vec<Problem>,
}

/// Whether the reader can hold or move a joint.
fn moves(joint: &Joint) -> bool {
    matches!(joint.joint_type, JointType::Revolute | JointType::Continuous | JointType::Prismatic)
}

/// The moving joint that leads on from a body, with its parent link's pose.
type Next<'a> = (&'a Joint, Pose<f64>);

impl<'a> Reader<'a> {
    fn refuse(&mut self, element: &str, name: &str, child: &str, message: String, remedy: &str) {
        let span = place(self.source.text(), element, name, child);
        let key = if child.is_empty() { format!("{element}[{name}]") } else { format!("{element}[{name}].{child}") };
        self.problems.push(Problem::at(self.source, span, message).key(key).value("").remedy(remedy));
    }

    /// Every number finite, every mass and inertia possible, every axis a direction.
    fn check_numbers(&mut self) {
        for link in &self.robot.links {
            let (mass, tensor) = (link.inertial.mass.value, inertia(link));
            let bare = mass == 0.0 && tensor == Sym3::splat(0.0);
            if !(mass.is_finite() && (mass > 0.0 || bare) && mass <= softdock_kernels::range::MASS) {
                let remedy = "write a mass above 0 kg, or leave out <inertial> for a frame without mass";
                self.refuse("link", &link.name, "mass", format!("link `{}` has the mass {mass} kg", link.name), remedy);
            } else if !bare && let Some(fault) = fault(tensor) {
                let message = format!("link `{}` has an inertia that no rigid body has: {fault}", link.name);
                let remedy = "take the tensor about the centre of mass from its source again, or raise the smaller \
                              principal moments until the greatest is at most their sum";
                self.refuse("link", &link.name, "inertia", message, remedy);
            }
            if !finite(&link.inertial.origin) {
                let message = format!("link `{}` has an inertial origin that is not finite", link.name);
                self.refuse("link", &link.name, "origin", message, "write finite numbers");
            }
        }
        for joint in &self.robot.joints {
            let axis = vec3(joint.axis.xyz[0], joint.axis.xyz[1], joint.axis.xyz[2]);
            let is_direction = axis.norm().is_finite() && axis.norm() > 1e-9;
            if !finite(&joint.origin) || (joint.joint_type != JointType::Fixed && !is_direction) {
                let message = format!("joint `{}` has an origin or axis that is no place or direction", joint.name);
                self.refuse("joint", &joint.name, "axis", message, "write finite numbers and an axis that is not zero");
            }
        }
    }

    /// Follows the chain from the root; `None` after a problem.
    fn chain(&mut self, mount: Pose<f64>) -> Option<Arm> {
        let root = self.root()?;
        self.moving = self.joints_to_end()?;
        let mut arm = Arm {
            links: Vec::new(),
            joints: Vec::new(),
            slides: Vec::new(),
            held: Vec::new(),
            on_base: Joined::nothing(),
            limits: Vec::new(),
            ratings: Vec::new(),
            frames: HashMap::new(),
            last: root.clone(),
        };
        let (base, mut next) = self.body(&root, mount, &mut arm)?;
        if base.mass != 0.0 && self.base == BaseMass::Refused {
            let message = format!("link `{root}` and what is fixed to it belong to the base but have mass");
            self.refuse("link", &root, "mass", message, "leave out its <inertial>; the base's mass is in the scenario");
        }
        while let Some((joint, parent)) = next {
            if arm.links.len() == MAX_JOINTS {
                let message = format!("the arm has more than {MAX_JOINTS} moving joints");
                self.refuse("joint", &joint.name, "", message, "fix the joints that do not move (type=\"fixed\")");
                return None;
            }
            let axis = vec3(joint.axis.xyz[0], joint.axis.xyz[1], joint.axis.xyz[2]);
            let turned = Pose { position: Vec3::zero(), attitude: from_z_to(axis) };
            let origin = parent.compose(pose(&joint.origin)).compose(turned);
            arm.joints.push(joint.name.clone());
            arm.slides.push(joint.joint_type == JointType::Prismatic);
            arm.limits.push(limits(joint));
            arm.ratings.push(rating(joint));
            arm.last.clone_from(&joint.child.link);
            // The number of links counts this one already, so that its frames are filed under it.
            arm.links.push(Link { origin, mass: 0.0, com: Vec3::zero(), inertia: Sym3::splat(0.0) });
            let (body, on) = self.body(&joint.child.link, turned.inverse(), &mut arm)?;
            if body.mass == 0.0 {
                let message = format!("link `{}` moves but has no mass", joint.child.link);
                self.refuse("link", &joint.child.link, "", message, "give it an <inertial> with <mass> and <inertia>");
                return None;
            }
            let (com, inertia) = body.about_com();
            let index = arm.links.len() - 1;
            arm.links[index] = Link { origin, mass: body.mass, com, inertia };
            next = on;
        }
        self.all_reached(&arm).then_some(arm)
    }

    /// The one link that is no joint's child.
    fn root(&mut self) -> Option<String> {
        for joint in &self.robot.joints {
            for link in [&joint.parent.link, &joint.child.link] {
                if !self.robot.links.iter().any(|l| l.name == *link) {
                    let message = format!("joint `{}` names the link `{link}`, which does not exist", joint.name);
                    self.refuse("joint", &joint.name, "", message, "correct the name, or add the link");
                    return None;
                }
            }
        }
        let is_child = |name: &str| self.robot.joints.iter().any(|joint| joint.child.link == name);
        let roots: Vec<&str> =
            self.robot.links.iter().map(|l| l.name.as_str()).filter(|name| !is_child(name)).collect();
        match roots[..] {
            [root] => Some(root.to_owned()),
            _ => {
                let message =
                    format!("the links have {} roots (links that are no joint's child), not one", roots.len());
                let first = self.robot.links.first().map_or("", |l| l.name.as_str());
                self.refuse("link", first, "", message, "join all links into one chain");
                None
            }
        }
    }

    /// The joints of the chain from the root to the link of part A, or to the only end; `None` after a problem.
    fn joints_to_end(&mut self) -> Option<HashSet<String>> {
        let robot = self.robot;
        let above = |link: &str| robot.joints.iter().find(|joint| joint.child.link == link);
        let chain_to = |end: &str| -> Vec<&Joint> {
            // A loop ends where its joints do; it is reported where the links are joined.
            std::iter::successors(above(end), |joint| above(&joint.parent.link)).take(robot.joints.len()).collect()
        };
        let moving = |end: &str| chain_to(end).into_iter().filter(|joint| moves(joint)).map(|joint| joint.name.clone());
        let known = self.stated.end.filter(|end| robot.links.iter().any(|link| link.name == **end));
        if let Some(end) = known {
            return Some(moving(end).collect());
        }
        let inner: HashSet<&str> = robot
            .joints
            .iter()
            .filter(|joint| moves(joint))
            .flat_map(|joint| chain_to(&joint.parent.link).into_iter().map(|joint| joint.name.as_str()))
            .collect();
        let ends: Vec<&Joint> =
            robot.joints.iter().filter(|joint| moves(joint) && !inner.contains(joint.name.as_str())).collect();
        match ends[..] {
            [] => Some(HashSet::new()),
            [end] => Some(moving(&end.child.link).collect()),
            [_, second, ..] => {
                let names: Vec<String> = ends.iter().map(|joint| format!("`{}`", joint.child.link)).collect();
                let message = format!("the arm has {} ends: {}", names.len(), names.join(", "));
                let remedy = match self.base {
                    BaseMass::Ignored => "keep one chain from the base to the end-effector",
                    _ => "write part_a.link, the link that carries part A: joints off its chain are held",
                };
                self.refuse("joint", &second.name, "", message, remedy);
                None
            }
        }
    }

    /// Mass of a link and of all beyond it \[kg\].
    fn mass_beyond(&self, link: &str) -> f64 {
        let (mut open, mut mass, mut seen) = (vec![link], 0.0, 0);
        while let Some(name) = open.pop() {
            seen += 1;
            // A loop is reported where the links are joined.
            if seen > self.robot.links.len() {
                break;
            }
            mass += self.robot.links.iter().find(|link| link.name == name).map_or(0.0, |link| link.inertial.mass.value);
            let beyond = self.robot.joints.iter().filter(|joint| joint.parent.link == name);
            open.extend(beyond.map(|joint| joint.child.link.as_str()));
        }
        mass
    }

    /// Where a joint off the chain is held, from the frame of its parent link.
    fn hold(&self, joint: &Joint, carrier: &str, arm: &mut Arm) -> Pose<f64> {
        let place = self.stated.held.and_then(|held| held.get(&joint.name)).copied().unwrap_or(0.0);
        let slides = joint.joint_type == JointType::Prismatic;
        let axis = vec3(joint.axis.xyz[0], joint.axis.xyz[1], joint.axis.xyz[2]);
        let turned = Pose { position: Vec3::zero(), attitude: from_z_to(axis) };
        arm.held.push(HeldJoint {
            name: joint.name.clone(),
            slides,
            limits: limits(joint),
            place,
            mass: self.mass_beyond(&joint.child.link),
            carrier: carrier.to_owned(),
        });
        pose(&joint.origin).compose(turned).compose(joint_motion(slides, place)).compose(turned.inverse())
    }

    /// The links fixed or held to `entry` as one body, and the moving joint that leads on; what is held to the base is
    /// not in its body but in `arm.on_base`.
    fn body(&mut self, entry: &str, at: Pose<f64>, arm: &mut Arm) -> Option<(Joined, Option<Next<'a>>)> {
        let mut joined = Joined::nothing();
        let mut next: Option<Next<'a>> = None;
        let mut open = vec![(entry.to_owned(), at, false)];
        while let Some((name, frame, is_held)) = open.pop() {
            if arm.frames.insert(name.clone(), (arm.links.len(), frame)).is_some() {
                let message = format!("link `{name}` is reached twice: the joints form a loop");
                self.refuse("link", &name, "", message, "let every link be the child of one joint");
                return None;
            }
            let robot = self.robot;
            let link = robot.links.iter().find(|link| link.name == name)?;
            if link.inertial.mass.value > 0.0 {
                let whole = if is_held && arm.links.is_empty() { &mut arm.on_base } else { &mut joined };
                whole.add(link.inertial.mass.value, inertia(link), frame.compose(pose(&link.inertial.origin)));
            }
            for joint in robot.joints.iter().filter(|joint| joint.parent.link == name) {
                if joint.mimic.is_some() {
                    let message = format!("joint `{}` mimics another one", joint.name);
                    let remedy = "make it fixed, or a joint of its own: coupled joints are not simulated";
                    self.refuse("joint", &joint.name, "mimic", message, remedy);
                    return None;
                }
                match joint.joint_type {
                    JointType::Fixed => {
                        open.push((joint.child.link.clone(), frame.compose(pose(&joint.origin)), is_held));
                    }
                    JointType::Prismatic if self.base == BaseMass::Ignored => {
                        let message = format!("joint `{}` slides, and a robot's axes turn", joint.name);
                        self.refuse("joint", &joint.name, "", message, "make it revolute or fixed");
                        return None;
                    }
                    _ if !moves(joint) => {
                        let message =
                            format!("joint `{}` is neither revolute, continuous, prismatic nor fixed", joint.name);
                        self.refuse("joint", &joint.name, "", message, "make it revolute, prismatic or fixed");
                        return None;
                    }
                    _ if self.moving.contains(&joint.name) => next = Some((joint, frame)),
                    _ => {
                        let place = self.hold(joint, entry, arm);
                        open.push((joint.child.link.clone(), frame.compose(place), true));
                    }
                }
            }
        }
        Some((joined, next))
    }

    /// Links outside the chain hang in a loop of their own.
    fn all_reached(&mut self, arm: &Arm) -> bool {
        let lost = self.robot.links.iter().find(|link| !arm.frames.contains_key(&link.name));
        if let Some(link) = lost {
            let message = format!("link `{}` is not connected to the root", link.name);
            self.refuse("link", &link.name, "", message, "join it to the chain, or remove it");
        }
        lost.is_none()
    }
}

/// The place of an element by its name, or of its first child of a kind.
fn place(text: &str, element: &str, name: &str, child: &str) -> Range<usize> {
    let open = format!("<{element} ");
    let named = [format!("name=\"{name}\""), format!("name='{name}'")];
    let tag_end = |start: usize| text[start..].find('>').map_or(text.len(), |at| start + at + 1);
    let found = text.match_indices(&open).map(|(start, _)| start).find(|start| {
        let tag = &text[*start..tag_end(*start)];
        named.iter().any(|name| tag.contains(name))
    });
    let start = found.unwrap_or(0);
    let end = text[start..].find(&format!("</{element}>")).map_or(text.len(), |at| start + at);
    let inner = [format!("<{child} "), format!("<{child}/")];
    let inside = inner.iter().find_map(|open| text[start..end].find(open.as_str()));
    match inside {
        Some(at) if !child.is_empty() => start + at..tag_end(start + at),
        _ => start..tag_end(start),
    }
}

fn limits(joint: &Joint) -> (f64, f64) {
    let (lower, upper) = (joint.limit.lower, joint.limit.upper);
    if matches!(joint.joint_type, JointType::Revolute | JointType::Prismatic) && lower < upper {
        (lower, upper)
    } else {
        (f64::NEG_INFINITY, f64::INFINITY)
    }
}

fn rating(joint: &Joint) -> JointRating {
    let stated = |value: f64| Some(value).filter(|value| value.is_finite() && *value > 0.0);
    let dynamics = joint.dynamics.as_ref();
    JointRating {
        effort: stated(joint.limit.effort),
        velocity: stated(joint.limit.velocity),
        damping: dynamics.and_then(|dynamics| stated(dynamics.damping)),
        friction: dynamics.and_then(|dynamics| stated(dynamics.friction)),
    }
}

fn inertia(link: &urdf_rs::Link) -> Sym3<f64> {
    let i = &link.inertial.inertia;
    Sym3 { xx: i.ixx, yy: i.iyy, zz: i.izz, xy: i.ixy, xz: i.ixz, yz: i.iyz }
}

fn finite(origin: &urdf_rs::Pose) -> bool {
    origin
        .xyz
        .iter()
        .chain(origin.rpy.iter())
        .all(|number| number.is_finite() && number.abs() < softdock_kernels::range::LENGTH)
}

fn pose(origin: &urdf_rs::Pose) -> Pose<f64> {
    let vector = |v: &urdf_rs::Vec3| vec3(v[0], v[1], v[2]);
    Pose { position: vector(&origin.xyz), attitude: from_roll_pitch_yaw(vector(&origin.rpy)) }
}

/// The shortest rotation that takes z to a direction.
fn from_z_to(axis: Vec3<f64>) -> Quat<f64> {
    let axis = axis * (1.0 / axis.norm());
    if axis.z < -1.0 + 1e-12 {
        // Half a turn about x.
        return Quat { w: 0.0, v: vec3(1.0, 0.0, 0.0) };
    }
    Quat { w: 1.0 + axis.z, v: vec3(0.0, 0.0, 1.0).cross(axis) }.normalized()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::placement::{end_frame, turned_by};

    const PLANAR: &str = r#"<robot name="two">
      <link name="root"/>
      <joint name="j1" type="revolute"><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
        <parent link="root"/><child link="a"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
      <link name="a"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
        <inertia ixx="0.1" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="weld" type="fixed"><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><parent link="a"/><child link="b"/></joint>
      <link name="b"><inertial><origin xyz="0 0 0"/><mass value="2"/>
        <inertia ixx="0.1" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
    </robot>"#;

    fn arm(text: &str) -> Result<Arm, Vec<Problem>> {
        arm_to(text, None, &[])
    }

    fn arm_to(text: &str, end: Option<&str>, held: &[(&str, f64)]) -> Result<Arm, Vec<Problem>> {
        let held = held.iter().map(|(name, place)| ((*name).to_owned(), *place)).collect();
        let source = Source::new("arm.urdf".into(), text.to_owned());
        read(&source, Pose::identity(), BaseMass::Refused, Stated { end, held: Some(&held) })
    }

    #[test]
    fn an_axis_in_any_direction_becomes_z_and_fixed_links_merge() {
        let arm = arm(PLANAR).expect("a valid arm");
        assert_eq!((arm.links.len(), arm.joints[0].as_str(), arm.limits[0]), (1, "j1", (-2.0, 2.0)));
        let link = arm.links[0];
        let axis = link.origin.attitude.rotate(vec3(0.0, 0.0, 1.0));
        assert!((axis - vec3(0.0, 1.0, 0.0)).norm() < 1e-15, "z of the link is the joint's axis");
        // Back in the URDF's axes: masses 2 + 2, centre of mass at x = 0.75.
        let com = link.origin.attitude.rotate(link.com);
        assert!((com - vec3(0.75, 0.0, 0.0)).norm() < 1e-14, "{com:?}");
        // About y: 0.2 + 0.2 (turned about z: xx of the second becomes yy) and the reduced mass 1 at 0.5 m.
        let inertia = link.inertia.rotated(link.origin.attitude.matrix());
        assert!((inertia.yy - (0.2 + 0.1 + 0.25)).abs() < 1e-14 && (inertia.xx - (0.1 + 0.2)).abs() < 1e-14);
        // A quarter turn about +y takes +x to -z.
        let tool = arm.frame(Some("b")).expect("at the end");
        let end = end_frame(&arm.links, &[], &[std::f64::consts::FRAC_PI_2], tool);
        assert!((end.position - vec3(1.0, 0.0, -1.0)).norm() < 1e-14, "{:?}", end.position);
        assert!(turned_by(end.attitude) > 1.0);
    }

    /// Two arms on a torso that turns, each of a joint that turns and one that slides; fingers as the second end.
    fn branched(fixed: bool, bend: f64, stroke: f64) -> String {
        let body = "<inertial><origin xyz=\"0.2 0.1 0\" rpy=\"0.1 0.2 0.3\"/><mass value=\"2\"/>\
                    <inertia ixx=\"0.1\" iyy=\"0.2\" izz=\"0.25\" ixy=\"0.01\" ixz=\"0\" iyz=\"0\"/></inertial>";
        let joint = |name: &str, kind: &str, parent: &str, child: &str, origin: &str, axis: &str| {
            format!(
                "<joint name=\"{name}\" type=\"{kind}\"><origin {origin}/><axis xyz=\"{axis}\"/><parent link=\"{parent}\"/>\
                 <child link=\"{child}\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>\
                 <link name=\"{child}\">{body}</link>"
            )
        };
        let origin = "xyz=\"0.3 0.1 -0.2\" rpy=\"0.4 0 0\"";
        let kinds = if fixed { ["fixed"; 2] } else { ["revolute", "prismatic"] };
        // The motion of the held joints by their origins: about and along the last axis of rpy and the x axis.
        let (moved, slid) = match fixed {
            true => (
                format!("xyz=\"0.3 0.1 -0.2\" rpy=\"{} 0 0\"", 0.4 + bend),
                format!("xyz=\"{} 0.1 -0.2\" rpy=\"0.4 0 0\"", 0.3 + stroke),
            ),
            false => (origin.to_owned(), origin.to_owned()),
        };
        format!(
            "<robot name=\"two arms\"><link name=\"root\"/>{}{}{}{}{}</robot>",
            joint("waist", "revolute", "root", "torso", origin, "0 0 1"),
            joint("left", "revolute", "torso", "left_arm", origin, "0 1 0"),
            joint("right", kinds[0], "torso", "right_arm", &moved, "1 0 0"),
            joint("slide", kinds[1], "right_arm", "right_hand", &slid, "1 0 0"),
            joint("wrist", "revolute", "left_arm", "left_hand", origin, "1 0 0"),
        )
    }

    #[test]
    fn joints_off_the_chain_are_held_as_if_they_were_fixed() {
        let (bend, stroke) = (0.3, -0.15);
        let held = arm_to(&branched(false, 0.0, 0.0), Some("left_hand"), &[("right", bend), ("slide", stroke)])
            .expect("two arms");
        let fixed = arm_to(&branched(true, bend, stroke), Some("left_hand"), &[]).expect("one arm");
        assert_eq!(held.joints, ["waist", "left", "wrist"]);
        let named =
            |joint: &HeldJoint| (joint.name.clone(), joint.slides, joint.place, joint.mass, joint.carrier.clone());
        assert_eq!(
            held.held.iter().map(named).collect::<Vec<_>>(),
            [
                ("right".to_owned(), false, bend, 4.0, "torso".to_owned()),
                ("slide".to_owned(), true, stroke, 2.0, "torso".to_owned()),
            ]
        );
        for (a, b) in held.links.iter().zip(&fixed.links) {
            assert_eq!((a.mass, a.origin), (b.mass, b.origin));
            assert!((a.com - b.com).norm() < 1e-14, "{:?} is not {:?}", a.com, b.com);
            let off = a.inertia.zip(b.inertia, |a, b| (a - b).abs());
            let most = [off.xx, off.yy, off.zz, off.xy, off.xz, off.yz].into_iter().fold(0.0, f64::max);
            assert!(most < 1e-14, "{:?} is not {:?}", a.inertia, b.inertia);
        }
        // The other end, along a joint that slides.
        let right = arm_to(&branched(false, 0.0, 0.0), Some("right_hand"), &[]).expect("two arms");
        assert_eq!((right.joints.join(" "), right.slides), ("waist right slide".to_owned(), vec![false, false, true]));
        assert_eq!(right.limits[2], (-1.0, 1.0));
    }

    #[test]
    fn several_ends_are_listed_and_what_the_base_carries_is_kept_apart() {
        let problems = arm_to(&branched(false, 0.0, 0.0), None, &[]).expect_err("two ends");
        assert!(problems[0].message.contains("2 ends: `right_hand`, `left_hand`"), "{}", problems[0]);
        let at_root = branched(false, 0.0, 0.0).replacen(
            "parent link=\"torso\"/><child link=\"right",
            "parent link=\"root\"/><child link=\"right",
            1,
        );
        let arm = arm_to(&at_root, Some("left_hand"), &[]).expect("a second arm on the base");
        assert_eq!((arm.on_base.mass, arm.links[0].mass), (4.0, 2.0));
        assert_eq!(arm.held[0].carrier, "root");
    }

    #[test]
    fn faults_are_named_with_their_place() {
        let cases = [
            ("mass value=\"2\"", "mass value=\"-2\"", 5, "link[a].mass"),
            ("izz=\"0.3\"", "izz=\"3\"", 6, "link[a].inertia"),
            ("xyz=\"0 1 0\"", "xyz=\"0 0 0\"", 3, "joint[j1].axis"),
            ("link=\"root\"/><child", "link=\"roof\"/><child", 3, "joint[j1]"),
            ("type=\"revolute\"", "type=\"floating\"", 3, "joint[j1]"),
            ("<child link=\"b\"/>", "<child link=\"a\"/>", 2, "link[root]"),
        ];
        for (old, new, line, key) in cases {
            let problems = arm(&PLANAR.replacen(old, new, 1)).expect_err(new);
            assert_eq!((problems[0].line, problems[0].key.as_str()), (line, key), "{new}: {}", problems[0]);
        }
        assert!(arm("<robot name=\"x\"><link name=\"a\">").is_err());
        assert!(arm("").is_err());
    }
}
