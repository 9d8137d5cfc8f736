//! The stage functions as the WGSL frame calls them: each traced once from the list of the kernels.

use crate::trace::{Sym, trace};
use crate::wgsl::{Function, Struct};
use softdock_kernels::contact::{Point, PointContact, PointState};
use softdock_kernels::fields::Bundle;
use softdock_kernels::material::Pair;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::LinkCounts;
use softdock_kernels::stages::{BundleShape, StageRow, shape_of, stages};
use softdock_kernels::vector::Vec3;

/// The WGSL struct of a bundle, by the bundle's own name.
pub fn structure<B: Bundle<Sym>>() -> Struct {
    of_shape(shape_of::<Sym, B>())
}

fn of_shape(BundleShape { name, fields }: BundleShape) -> Struct {
    let name = if name == "Sym" { "f32" } else { name };
    Struct { name: name.to_owned(), fields }
}

/// Every stage function of a scenario, in the order of the loop.
pub fn functions<const N: usize>(m: &Plant) -> Vec<Function> {
    stages::<Sym, N>(m).into_iter().map(traced).collect()
}

/// Traces a stage function.
pub fn traced(row: StageRow<'_, Sym>) -> Function {
    let StageRow { name, arguments, result, call } = row;
    let count = arguments.iter().map(|(_, shape)| shape.fields.len()).sum();
    let graph = trace(count, call);
    let arguments = arguments.into_iter().map(|(name, shape)| (name.to_owned(), of_shape(shape))).collect();
    Function { name, arguments, result: of_shape(result), graph }
}

/// The structs of stage functions, and those that the frame names whatever the functions are.
pub fn structures(functions: &[Function]) -> Vec<Struct> {
    let mut all = vec![
        structure::<Vec3<Sym>>(),
        structure::<LinkCounts<Sym>>(),
        structure::<Pair<Sym>>(),
        structure::<Point<Sym>>(),
        structure::<PointState<Sym>>(),
        structure::<PointContact<Sym>>(),
    ];
    for function in functions {
        for structure in function.arguments.iter().map(|(_, structure)| structure).chain([&function.result]) {
            if !structure.is_scalar() && all.iter().all(|known| known.name != structure.name) {
                all.push(structure.clone());
            }
        }
    }
    all
}
