//! Contact events of one run: which pair touches, when, where and how hard, from the contacts of every substep.

use softdock_kernels::contact::distance::solid_distance;
use softdock_kernels::contact::shell::{ShellTouch, no_shell_touch, relative, shell_point};
use softdock_kernels::contact::{PointContact, PointState, sliding_velocity};
use softdock_kernels::frame::observer::ContactObserver;
use softdock_kernels::material::Pair;
use softdock_kernels::model::Side;
use softdock_kernels::monitor::port_power;
use softdock_kernels::outcome::ContactEvent;
use softdock_kernels::plant::{ContactPair, Plant, PointOfPair, PointSource, PreparedSolid, ShellOfPair};
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::vector::{Sym3, Vec3};

/// Records the contact events of one loop.
///
/// All points of a solid that meet the same solid are one event. A separation of at most `merge_gap` does not end it. Where
/// the shell of a mesh meets several solids at a time, each has the normal forces of the points next to it, and a share of
/// the shell's friction by its normal forces.
#[derive(Clone, Debug)]
pub struct ContactRecorder {
    merge_gap: f64,
    /// Number of the substep under way, and its contacts so far.
    substep: u64,
    touching: Vec<(usize, PointState<f64>, PointContact<f64>)>,
    running: Vec<Running>,
    ended: Vec<ContactEvent>,
}

/// An event that has not ended.
#[derive(Clone, Debug)]
struct Running {
    event: ContactEvent,
    /// First and last substep with a force.
    substeps: [u64; 2],
    /// Wrench on part A in the substep before.
    push: Wrench<f64>,
}

/// A point or solid of part A against one of part B in one substep.
#[derive(Clone, Copy, Debug)]
struct Touching {
    members: [PointSource; 2],
    /// Wrench on part A about its origin, axes of the loop.
    wrench: Wrench<f64>,
    /// Sum of the normal forces \[N\].
    normal_force: f64,
    /// Sum of their sizes \[N\].
    load: f64,
    /// Sliding of the points in the substep, weighted by the sizes \[N m\].
    slip: f64,
    /// Greatest overlap \[m\].
    depth: f64,
    /// The most loaded point: size of its normal force, normal out of part B, place from part A's origin.
    most: f64,
    normal: Vec3<f64>,
    lever: Vec3<f64>,
}

impl ContactRecorder {
    /// Before the first substep; separations of at most `merge_gap` \[s\] do not end an event.
    pub fn new(merge_gap: f64) -> Self {
        Self { merge_gap, substep: 0, touching: Vec::new(), running: Vec::new(), ended: Vec::new() }
    }

    /// The events in the order of their start; those of one substep in the order of their points.
    pub fn into_events(self) -> Vec<ContactEvent> {
        let last = self.substep;
        let running = self.running.into_iter().map(|running| {
            // The substep under way was never shown: the last one is the one before it.
            ContactEvent { is_open: running.substeps[1] + 1 == last, ..running.event }
        });
        let mut events: Vec<ContactEvent> = self.ended.into_iter().chain(running).collect();
        events.sort_by(|one, two| one.start.total_cmp(&two.start));
        events
    }

    /// Goes on with the events of the pairs that touch, and begins new ones.
    fn begin_or_extend(&mut self, m: &Plant, time: f64, parts: &Parts<f64>, pairs: &[Touching]) {
        for pair in pairs {
            let known = self.running.iter().position(|running| running.event.members == pair.members);
            let place = known.unwrap_or_else(|| {
                self.running.push(Running::new(m, self.substep, time, parts, pair));
                self.running.len() - 1
            });
            self.running[place].extend(m, self.substep, time, parts, pair);
        }
    }

    /// Ends the events of the pairs that are apart for longer than the merge gap.
    fn end(&mut self, m: &Plant, parts: &Parts<f64>) {
        let longest = self.merge_gap * (1.0 + 1e-9);
        let (ended, substep) = (&mut self.ended, self.substep);
        self.running.retain_mut(|running| {
            let apart = substep - running.substeps[1];
            if apart == 1 {
                running.add_work(m, parts, Wrench::zero());
            }
            let goes_on = apart as f64 * m.timing.substep <= longest;
            if !goes_on {
                ended.push(running.event);
            }
            goes_on
        });
    }
}

impl ContactObserver<f64> for ContactRecorder {
    fn contact(&mut self, index: usize, before: &PointState<f64>, contact: &PointContact<f64>) {
        if contact.force.abs() > 0.0 {
            self.touching.push((index, *before, *contact));
        }
    }

    fn substep(&mut self, m: &Plant, pairs: &[Pair<f64>], time: f64, parts: &Parts<f64>) {
        let mut together: Vec<Touching> = Vec::new();
        for (index, before, contact) in self.touching.drain(..) {
            for one in touching(m, pairs, parts, index, &before, &contact) {
                match together.iter_mut().find(|other| other.members == one.members) {
                    Some(other) => other.add(&one),
                    None => together.push(one),
                }
            }
        }
        self.begin_or_extend(m, time, parts, &together);
        self.end(m, parts);
        self.substep += 1;
    }
}

impl Touching {
    /// With more points of the same pair.
    fn add(&mut self, more: &Self) {
        self.wrench = self.wrench + more.wrench;
        self.normal_force += more.normal_force;
        self.load += more.load;
        self.slip += more.slip;
        self.depth = self.depth.max(more.depth);
        if self.most < more.most {
            (self.most, self.normal, self.lever) = (more.most, more.normal, more.lever);
        }
    }
}

impl Running {
    /// An event that begins in this substep, without what happens in it.
    fn new(m: &Plant, substep: u64, time: f64, parts: &Parts<f64>, pair: &Touching) -> Self {
        let [of_a, of_b] = pair.members;
        let row = m.contact.pairs.iter().position(|row| row.has(Side::A, of_a) && row.has(Side::B, of_b));
        let event = ContactEvent {
            members: pair.members,
            pair: row,
            start: time,
            duration: 0.0,
            peak_time: time,
            place: Vec3::zero(),
            normal: Vec3::zero(),
            peak_force: -1.0,
            peak_normal_force: f64::NEG_INFINITY,
            impulse: Vec3::zero(),
            slip: 0.0,
            work: 0.0,
            depth: pair.depth,
            closing_speed: -sliding_velocity(&parts.a, &parts.b, pair.lever).dot(pair.normal),
            is_open: false,
        };
        Self { event, substeps: [substep; 2], push: Wrench::zero() }
    }

    /// One more substep with a force.
    fn extend(&mut self, m: &Plant, substep: u64, time: f64, parts: &Parts<f64>, pair: &Touching) {
        self.add_work(m, parts, pair.wrench);
        let (event, dt) = (&mut self.event, m.timing.substep);
        self.substeps[1] = substep;
        event.duration = (substep - self.substeps[0] + 1) as f64 * dt;
        event.impulse = pair.wrench.force.scale_add(dt, event.impulse);
        event.slip += pair.slip / pair.load;
        event.depth = event.depth.max(pair.depth);
        event.peak_normal_force = event.peak_normal_force.max(pair.normal_force);
        let force = pair.wrench.force.norm();
        if event.peak_force < force {
            let in_b = |v: Vec3<f64>| parts.b.attitude.rotate_back(v);
            event.place = in_b((parts.a.position - parts.b.position) + pair.lever);
            (event.normal, event.peak_force, event.peak_time) = (in_b(pair.normal), force, time);
        }
    }

    /// The parts came here with this substep's velocity under the mean of the last wrench and this one, as the monitor
    /// has it.
    fn add_work(&mut self, m: &Plant, parts: &Parts<f64>, push: Wrench<f64>) {
        let sum = self.push + push;
        self.event.work += 0.5 * m.timing.substep * port_power(parts, sum);
        self.push = push;
    }
}

/// What a contact point or shell that pushes does to each solid that it meets.
fn touching(
    m: &Plant,
    pairs: &[Pair<f64>],
    parts: &Parts<f64>,
    index: usize,
    before: &PointState<f64>,
    contact: &PointContact<f64>,
) -> Vec<Touching> {
    match m.contacts.get(index) {
        Some(point) => vec![point_touching(m, &pairs[point.pair], parts, point, before, contact)],
        None => {
            let shell = &m.shells[index - m.contacts.len()];
            shell_touching(m, &pairs[shell.pair], parts, shell, before, contact)
        }
    }
}

/// Motions of the parts with the points and with the solids.
fn of_points<'a>(of: &ContactPair, parts: &'a Parts<f64>) -> (&'a Motion<f64>, &'a Motion<f64>) {
    match of.points_of {
        Side::A => (&parts.a, &parts.b),
        Side::B => (&parts.b, &parts.a),
    }
}

/// A source of the part with the points and a solid of the other, in the order of the parts.
fn members(of: &ContactPair, source: PointSource, solid: usize) -> [PointSource; 2] {
    match of.points_of {
        Side::A => [source, PointSource::Solid(solid)],
        Side::B => [PointSource::Solid(solid), source],
    }
}

/// Index of the solid of a law that is nearest to a point, both in the frame of their part.
fn nearest(solids: &[PreparedSolid], point: Vec3<f64>) -> usize {
    let distances = solids.iter().map(|solid| (solid_distance(solid, point).distance, solid.index));
    distances.reduce(|best, next| if next.0 < best.0 { next } else { best }).map_or(0, |(_, index)| index)
}

fn point_touching(
    m: &Plant,
    pair: &Pair<f64>,
    parts: &Parts<f64>,
    point: &PointOfPair,
    before: &PointState<f64>,
    contact: &PointContact<f64>,
) -> Touching {
    let of = &m.pairs[point.pair];
    let (own, other) = of_points(of, parts);
    let from_other = (own.position - other.position) + own.attitude.rotate(point.point.position);
    let solid = nearest(&of.solids, other.attitude.rotate_back(from_other));
    let of_a = sliding_velocity(&parts.a, &parts.b, contact.lever);
    let velocity = if of.points_of == Side::A { of_a } else { -of_a };
    let (normal, slip) = (other.attitude.rotate_back(contact.normal), other.attitude.rotate_back(velocity));
    let flat = |v: Vec3<f64>| normal.scale_add(-normal.dot(v), v);
    let load = contact.force.abs();
    // Along the normal the bristle of a patch is its twist, which is no way.
    let after = contact.state.bristle;
    let after = if of.patch_radius > 0.0 { flat(after) } else { after };
    Touching {
        members: members(of, point.source, solid),
        wrench: contact.wrench,
        normal_force: contact.force,
        load,
        slip: load * slid(m, pair, flat, slip, before, after),
        depth: contact.depth,
        most: load,
        normal: contact.normal,
        lever: contact.lever,
    }
}

/// Sliding in a substep beyond the deflection of the bristle, which `flat` makes tangential \[m\].
///
/// A bristle that sticks takes up the whole motion. Without a spring nothing does.
fn slid(
    m: &Plant,
    pair: &Pair<f64>,
    flat: impl Fn(Vec3<f64>) -> Vec3<f64>,
    slip: Vec3<f64>,
    before: &PointState<f64>,
    after: Vec3<f64>,
) -> f64 {
    let moved = flat(slip) * m.timing.substep;
    if pair.bristle_stiffness > 0.0 { (flat(before.bristle) + moved - after).norm() } else { moved.norm() }
}

/// The shell against each of the solids that its points push, as the contact stage has it.
fn shell_touching(
    m: &Plant,
    pair: &Pair<f64>,
    parts: &Parts<f64>,
    shell: &ShellOfPair,
    before: &PointState<f64>,
    contact: &PointContact<f64>,
) -> Vec<Touching> {
    let of = &m.pairs[shell.pair];
    let motion = relative(m, shell, parts);
    let mut whole = no_shell_touch();
    let mut each: Vec<(usize, ShellTouch<f64>)> = Vec::new();
    for point in &shell.points {
        let add = |sum: &ShellTouch<f64>| shell_point(m, of, pair, &motion, point, before.approach, sum);
        let (alone, solid) = (add(&no_shell_touch()), || motion.axes.times(point.position) + motion.position);
        whole = add(&whole);
        if alone.load.abs() > 0.0 {
            let solid = nearest(&of.solids, solid());
            match each.iter_mut().find(|(other, _)| *other == solid) {
                Some((_, sum)) => *sum = add(sum),
                None => each.push((solid, add(&no_shell_touch()))),
            }
        }
    }
    let size = trace(&whole.normals);
    let (centre, flat) = (whole.centre * (1.0 / size), |v: Vec3<f64>| v - whole.normals.times(v) * (1.0 / size));
    let slip = slid(m, pair, flat, motion.velocity + motion.omega.cross(centre), before, contact.state.bristle);
    let (own, other) = of_points(of, parts);
    let axes = other.attitude.matrix();
    let sign = if of.points_of == Side::A { 1.0 } else { -1.0 };
    let friction = axes.transposed_times(contact.wrench.force) * sign - whole.force;
    let all: f64 = each.iter().map(|(_, sum)| trace(&sum.normals)).sum();
    let offset = if of.points_of == Side::A { Vec3::zero() } else { own.position - other.position };
    let one = |(solid, sum): &(usize, ShellTouch<f64>)| {
        let load = trace(&sum.normals);
        let friction = friction * (load / all);
        let force = axes.times(sum.force + friction);
        let moment = axes.times(sum.moment + centre.cross(friction)) + offset.cross(force);
        let normal = axes.times(sum.force);
        Touching {
            members: members(of, shell.source, *solid),
            wrench: Wrench { force: force * sign, moment: moment * sign },
            normal_force: sum.load,
            load,
            slip: load * slip,
            depth: sum.depth,
            most: load,
            normal: normal * (sign / normal.norm().max(f64::MIN_POSITIVE)),
            lever: offset + axes.times(sum.centre * (1.0 / load)),
        }
    };
    each.iter().map(one).collect()
}

/// Sum of the sizes of the normal forces \[N\]: the trace of the weighted squares of unit normals.
fn trace(normals: &Sym3<f64>) -> f64 {
    normals.xx + normals.yy + normals.zz
}
