//! `softdock schema`: the JSON Schema of the file formats.

use crate::args::{SchemaArgs, SchemaKind};
use crate::words::{Exit, say};

/// Prints a schema.
pub(crate) fn schema(args: &SchemaArgs) -> miette::Result<Exit> {
    say(match args.kind {
        SchemaKind::Campaign => softdock_campaign::json_schema(),
        SchemaKind::Rig => softdock_campaign::rig_json_schema(),
        SchemaKind::Robot => softdock_campaign::robot_json_schema(),
        SchemaKind::Scenario => softdock_campaign::scenario_json_schema(),
    });
    Ok(Exit::Done)
}
