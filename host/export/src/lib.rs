//! Scenes and runs for other programs: URDF and MJCF of the nominal scene, MCAP of a run.
//!
//! All three come from one tree of frames ([`SceneTree`]): bodies, joints and shapes with their names.

mod lathe;
mod mjcf;
mod recording;
mod tree;
mod urdf;
mod xml;

pub use mjcf::mjcf_files;
pub use recording::{RecordingError, run_recording};
pub use tree::{SceneFrame, SceneJoint, SceneTree};
pub use urdf::urdf_files;

use softdock_results::ResultFile;

/// Files of an exported scene, and what the format has no counterpart for.
#[derive(Clone, Debug)]
pub struct ExportedScene {
    /// The main file first, then the meshes that it names.
    pub files: Vec<ResultFile>,
    /// What was left out or simplified.
    pub notes: Vec<String>,
}
