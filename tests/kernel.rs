//! The tracer and the emitted WGSL: field tables against reflection, random expressions against their trace.

use crate::parity::evaluate;
use proptest::prelude::*;
use softdock_engine::blocks::BlockKind;
use softdock_kernels::effects::EffectSet;
use softdock_kernels::frame::Batch;
use softdock_kernels::lanes::{Lane, plain};
use softdock_kernels::plant::Plant;
use softdock_kernels::real::Real;
use softdock_tracer::kernel::kernel;
use softdock_tracer::trace::{Sym, trace};
use std::path::Path;

fn shipped(scenario: &str) -> Plant {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/scenarios").join(scenario);
    Plant::new(softdock_campaign::load_scenario(&path).expect("a shipped scenario loads").model)
}

#[test]
fn the_emitted_structs_are_the_field_tables() {
    for scenario in [
        "smoke.toml",
        "plate_impact.toml",
        "probe_drogue.toml",
        "berth.toml",
        "insert.toml",
        "jamming.toml",
        "servo.toml",
        "grapple.toml",
        "adapter_ring.toml",
        "soft_capture.toml",
    ] {
        let kernel = kernel(&shipped(scenario), Batch::whole());
        let module = naga::front::wgsl::parse_str(&kernel.text).expect("the kernel is WGSL");
        for table in &kernel.structs {
            let (_, ty) = module
                .types
                .iter()
                .find(|(_, ty)| ty.name.as_deref() == Some(table.name.as_str()))
                .unwrap_or_else(|| panic!("{scenario}: struct {} is not in the module", table.name));
            let naga::TypeInner::Struct { members, .. } = &ty.inner else { panic!("{} is no struct", table.name) };
            assert_eq!(members.len(), table.fields.len(), "{}", table.name);
            for (index, (member, field)) in members.iter().zip(&table.fields).enumerate() {
                assert_eq!(member.name.as_deref(), Some(field.name.as_str()), "{}", table.name);
                assert_eq!(member.offset as usize, 4 * index, "{}.{}", table.name, field.name);
            }
        }
    }
}

#[test]
fn parts_that_never_touch_have_a_kernel() {
    let mut model = (*shipped("probe_drogue.toml")).clone();
    (model.contact.a, model.contact.b) = Default::default();
    let text = kernel(&Plant::new(model), Batch::whole()).text;
    naga::front::wgsl::parse_str(&text).expect("the kernel is WGSL");
}

#[test]
fn a_stage_is_short_enough_to_read_and_to_compile() {
    let kernel = kernel(&shipped("probe_drogue.toml"), Batch::whole());
    for function in &kernel.functions {
        assert!(function.operations() <= 5000, "{}: {} operations", function.name, function.operations());
    }
}

#[test]
fn an_effect_that_no_run_has_is_not_in_the_kernel() {
    let whole = shipped("smoke_joint.toml");
    let own = EffectSet::of(&whole.nominal, &whole.timing);
    let bare = whole.clone().with_effects(own);
    let of = |plant: &Plant, name: &str| {
        let kernel = kernel(plant, Batch::whole());
        let stage = kernel.functions.into_iter().find(|function| function.name == name).expect("a stage");
        (stage.operations(), stage.listing())
    };
    for (stage, parameter) in
        [("drive1", "robot1_cable_hysteresis"), ("drive2", "robot2_torque_ripple"), ("contact_point", "exponent_error")]
    {
        let ((operations, text), (most, all)) = (of(&bare, stage), of(&whole, stage));
        println!("{stage}: {operations} operations of {most}");
        assert!(operations < most && all.contains(parameter) && !text.contains(parameter), "{stage}: {parameter}");
    }
}

/// One step of a random program: an operation on earlier values.
pub(crate) type Step = (u8, usize, usize, usize);

/// Runs a random program on any scalar.
pub(crate) fn program<R: Real>(steps: &[Step], inputs: [R; 3]) -> R {
    let mut pool = vec![inputs[0], inputs[1], inputs[2], R::lit(0.0), R::lit(1.0), R::lit(-1.0), R::lit(0.37)];
    for &(operation, a, b, c) in steps {
        let pick = |i: usize| pool[i % pool.len()];
        let (a, b, c) = (pick(a), pick(b), pick(c));
        pool.push(match operation % 11 {
            0 => a + b,
            1 => a - b,
            2 => a * b,
            3 => a / (b * b + R::lit(1.0)),
            4 => -a,
            5 => a.mul_add(b, c),
            6 => a.abs().sqrt(),
            7 => a.min(b),
            8 => a.max(b),
            9 => R::select(a.lt(b) & !b.le(c), a, c),
            _ => a.floor(),
        });
    }
    pool[pool.len() - 1]
}

/// A product of constants that is rounded before the sum would not be the fused one.
#[test]
fn a_fused_product_of_constants_folds_only_where_it_is_exact() {
    fn sum<R: Real>(factor: f64, x: R) -> R {
        R::lit(factor).mul_add(R::lit(factor), x)
    }
    for factor in [0.37, 0.5] {
        let graph = trace(1, |inputs: &[Sym]| vec![sum(factor, inputs[0])]);
        for x in [-0.1369, 0.1, 3.7] {
            assert_eq!(evaluate(&graph, &[x])[0].value.to_bits(), sum(factor, x).to_bits(), "{factor} {x}");
        }
    }
}

proptest! {
    #[test]
    fn random_programs_agree_between_f64_lanes_and_trace(
        steps in prop::collection::vec((any::<u8>(), any::<usize>(), any::<usize>(), any::<usize>()), 1..40),
        x in -3.0..3.0_f64, y in -3.0..3.0_f64, z in -3.0..3.0_f64,
    ) {
        let scalar = program(&steps, [x, y, z]);
        prop_assume!(scalar.is_finite() && scalar.abs() < 1e30);
        let lanes = program(&steps, [x, y, z].map(|value| plain::PlainLanes::gather(|_| value)));
        (0..plain::PlainLanes::WIDTH).for_each(|lane| assert_eq!(lanes.lane(lane).to_bits(), scalar.to_bits()));
        let graph = trace(3, |inputs: &[Sym]| vec![program(&steps, [inputs[0], inputs[1], inputs[2]])]);
        // Folding changes signs of zeros and no other bit (-0 + 0 and 0 * -x).
        prop_assert_eq!(evaluate(&graph, &[x, y, z])[0].value, scalar);
    }
}

#[test]
fn block_kernels_are_complete() {
    for kind in [
        BlockKind::Drive,
        BlockKind::Controller,
        BlockKind::Sensor,
        BlockKind::Contact,
        BlockKind::Command,
        BlockKind::Body,
        BlockKind::Toss,
    ] {
        let text = kind.kernel(1e-3);
        for name in ["lateness", "start", "advance", "output", "replay", "input_at", "params_of", "put_output"] {
            assert_eq!(text.matches(&format!("fn {name}(")).count(), 1, "{kind:?}: {name}");
        }
    }
}
