//! Pegs and holes: how far a part goes in, and what a run that does not go in is called.

use super::bench::{at, closing, inertia, run};
use softdock_campaign::criteria::first_breach;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::{Model, PartShape, Shape, Solid, Timing};
use softdock_kernels::params::Params;
use softdock_kernels::vector::{Vec3, vec3};

/// Clearance of the square peg on each side \[m\].
const CLEARANCE: f64 = 5e-5;

fn solid(place: Vec3<f64>, shape: Shape) -> Solid {
    Solid { frame: at(place.x, place.y, place.z), shape }
}

/// A square peg of 40 mm before a hole between four boxes, 100 mm deep and open behind.
fn square(gap: f64) -> Model {
    let timing = Timing { substep: 0.25e-3, substeps: 4, max_ticks: 2000 };
    let mut model = Model::two_bodies(timing, gap);
    model.base_inertia = inertia(0.02, 0.05, 0.05);
    model.base_pose.position = vec3(-0.04 - gap, 0.0, 0.0);
    model.tool = at(0.04, 0.0, 0.0);
    let peg = solid(vec3(-0.04, 0.0, 0.0), Shape::Box { half: vec3(0.04, 0.02, 0.02) });
    model.contact.a = PartShape { points: Vec::new(), solids: vec![peg] };
    let (inner, thick) = (0.02 + CLEARANCE, 0.02);
    let beside = |y: f64| solid(vec3(0.05, y, 0.0), Shape::Box { half: vec3(0.05, thick, inner + 2.0 * thick) });
    let above = |z: f64| solid(vec3(0.05, 0.0, z), Shape::Box { half: vec3(0.05, inner, thick) });
    let walls = vec![beside(inner + thick), beside(-inner - thick), above(inner + thick), above(-inner - thick)];
    model.contact.b = PartShape { points: Vec::new(), solids: walls };
    model.task.min_insertion = 0.06;
    model
}

fn inserted(offset: Vec3<f64>, tilt: Vec3<f64>) -> (Metrics<f64>, Option<&'static str>) {
    let model = square(5e-3);
    let params = Params {
        base_mass: 10.0,
        target_mass: 1e6,
        target_inertia_scale: 1e6,
        offset,
        tilt,
        ..closing(1.0, 0.05, 1e6, 200.0)
    };
    let metrics = run(model.clone(), &[params])[0].space;
    (metrics, first_breach(&model.task, &metrics).map(|(criterion, _)| criterion.id))
}

#[test]
fn square_peg_with_50_um_of_clearance_goes_in_where_geometry_allows() {
    let none = Vec3::zero();
    let aside = |y: f64, z: f64| vec3(0.0, y, z);
    for (offset, tilt) in [(none, none), (aside(4e-5, -4e-5), none), (none, vec3(0.0, 0.0, 4e-4))] {
        let (metrics, breach) = inserted(offset, tilt);
        assert_eq!(breach, None, "{offset:?}, {tilt:?}: {} m", metrics.insertion);
    }
    // Without a chamfer a peg that is half a millimetre aside stands on the face.
    let (metrics, breach) = inserted(aside(5e-4, 0.0), none);
    assert_eq!(breach, Some("min_insertion"), "{} m", metrics.insertion);
    assert!(metrics.insertion < 1e-3, "{} m", metrics.insertion);
}
