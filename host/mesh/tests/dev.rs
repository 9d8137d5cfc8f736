#[path = "../../../tests/oracles/meshes.rs"]
mod meshes;
