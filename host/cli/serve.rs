//! `softdock serve`: results folders in a browser on this machine.

use crate::progress::{listen, stopped};
use crate::terminal::{Exit, Failure, Format, Outcome};
use clap::Args;
use serde_json::json;
use softdock_serve::{ResultsServer, found_folders};
use std::path::PathBuf;
use std::time::Duration;

/// Serve the results folders below a folder in a browser: verdicts, pages, running campaigns, comparisons.
#[derive(Args, Debug)]
#[command(after_help = "\
The pages are served to this machine only. To open them from another machine, forward the port: ssh -L 8766:127.0.0.1:8766.
Nothing is written. Ctrl-C ends the server.

Examples:
  softdock serve
  softdock serve /data/studies --address 127.0.0.1:0")]
pub(crate) struct ServeArgs {
    /// Folder with results folders.
    #[arg(value_name = "DIR", default_value = "results")]
    folder: PathBuf,
    /// Loopback address; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8766")]
    address: String,
}

pub(crate) fn serve(args: &ServeArgs, format: &Format) -> Outcome {
    if !args.folder.is_dir() {
        let message = format!("`{}` is no folder", args.folder.display());
        return Err(Failure::new(message, "name a folder with results folders: softdock serve DIR"));
    }
    let remedy =
        "write --address 127.0.0.1:8766, or another port; to open the pages from another machine, forward it with ssh";
    let server = ResultsServer::start(&args.folder, &args.address).map_err(|error| Failure::new(error, remedy))?;
    listen();
    let (address, count) = (format!("http://{}/", server.address()), found_folders(&args.folder).len());
    format.print(
        || json!({ "address": address, "folders": count }),
        || format!("{count} results folders of `{}`\npages  {address}", args.folder.display()),
    );
    while !stopped() {
        std::thread::sleep(Duration::from_millis(100));
    }
    Ok(Exit::Done)
}
