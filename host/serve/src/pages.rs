//! The server and its routes.

use crate::folders::{FoundFolder, PAGES, found_folder, found_folders, now};
use crate::live::Answers;
use axum::extract::{Path as UrlPath, State};
use axum::http::StatusCode;
use axum::response::Response;
use axum::routing::get;
use serde_json::{Value, json};
use softdock_analysis::STYLE;
use softdock_farm::{FarmError, FolderWatch, Shown, compare_folders};
use softdock_web::{LoopbackServer, Router, WebError, answer, page, refusal};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Largest page that is read.
const MOST_BYTES: u64 = 64 << 20;

/// Serves the results folders below a folder, until dropped.
pub struct ResultsServer {
    server: LoopbackServer,
}

/// What the routes share.
#[derive(Clone)]
struct Shelf {
    root: Arc<PathBuf>,
    answers: Answers,
    watches: Watches,
}

/// What is known of the folders that are looked at; a folder that nobody has looked at for long is forgotten.
#[derive(Clone, Default)]
struct Watches(Arc<Mutex<VecDeque<(PathBuf, Watch)>>>);

/// One of them.
type Watch = Arc<Mutex<FolderWatch>>;

/// Folders that are watched at a time.
const MOST_WATCHES: usize = 16;

impl Watches {
    fn of(&self, path: &Path) -> Watch {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = all.iter().position(|(own, _)| own == path).and_then(|at| all.remove(at));
        let entry = known.unwrap_or_else(|| (path.to_owned(), Arc::default()));
        let watch = entry.1.clone();
        all.push_front(entry);
        all.truncate(MOST_WATCHES);
        watch
    }
}

impl ResultsServer {
    /// Serves the results below `root` at a loopback address.
    ///
    /// # Errors
    /// If the address is not on loopback, or cannot be bound.
    pub fn start(root: &Path, address: &str) -> Result<Self, WebError> {
        let shelf = Shelf { root: Arc::new(root.to_owned()), answers: Answers::default(), watches: Watches::default() };
        let router = Router::new()
            .route("/", get(index))
            .route("/api/folders", get(folders))
            .route("/api/live/{folder}", get(live))
            .route("/api/compare/{first}/{second}", get(compare))
            .route("/page/{folder}/{page}", get(written_page))
            .with_state(shelf);
        Ok(Self { server: LoopbackServer::start(address, "results pages", router)? })
    }

    /// Returns the address.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }
}

impl Shelf {
    /// A folder by its place; other paths do not exist here.
    fn folder(&self, name: &str) -> Result<FoundFolder, Box<Response>> {
        // The served folder itself has no name, and a path of a route no empty part.
        let name = if name == "." { "" } else { name };
        found_folder(&self.root, name)
            .ok_or_else(|| Box::new(refusal(StatusCode::NOT_FOUND, "there is no such results folder")))
    }
}

async fn index() -> Response {
    page(include_str!("index.html").replace("/* STYLE */", STYLE))
}

async fn folders(State(shelf): State<Shelf>) -> Response {
    answer(
        &json!({ "now_unix_s": now(), "root": shelf.root.display().to_string(), "folders": found_folders(&shelf.root) }),
    )
}

async fn live(State(shelf): State<Shelf>, UrlPath(name): UrlPath<String>) -> Response {
    match shelf.folder(&name) {
        Ok(folder) => {
            let (path, question) = (folder.path.clone(), format!("live {name}"));
            let watch = shelf.watches.of(&path);
            let mut found = shelf.answers.ask(&question, move || live_state(&path, &watch));
            found["folder"] = json!(folder);
            answer(&found)
        }
        Err(refused) => *refused,
    }
}

async fn compare(State(shelf): State<Shelf>, UrlPath(names): UrlPath<(String, String)>) -> Response {
    match (shelf.folder(&names.0), shelf.folder(&names.1)) {
        (Ok(first), Ok(second)) => {
            let question = format!("compare {}:{} {}", names.0.len(), names.0, names.1);
            let work = move || match compare_folders(&first.path, &second.path) {
                Ok(compared) => json!({ "text": compared.text(), "data": compared.json() }),
                Err(error) => error_of(&error),
            };
            answer(&shelf.answers.ask(&question, work))
        }
        (Err(refused), _) | (_, Err(refused)) => *refused,
    }
}

/// Summary of the whole shards of a folder, runs of the others, and who makes them.
fn live_state(path: &Path, watch: &Mutex<FolderWatch>) -> Value {
    let mut watch = watch.lock().unwrap_or_else(|poisoned| {
        // What a panic has left of the counts is not used.
        let mut watch = poisoned.into_inner();
        *watch = FolderWatch::default();
        watch
    });
    match watch.status(path) {
        Ok(found) => {
            let text = found.shown.text();
            let kind = match found.shown {
                Shown::Nothing => "nothing",
                Shown::Campaign(_) => "campaign",
                Shown::Variants(_) => "variants",
            };
            json!({
                "kind": kind, "text": text, "partial_runs": found.partial_runs, "notes": found.notes(path),
                "summary": found.shown.json(),
            })
        }
        Err(error) => error_of(&error),
    }
}

fn error_of(error: &FarmError) -> Value {
    json!({ "error": error.to_string(), "remedy": error.remedy() })
}

/// A page that softdock wrote into a folder.
async fn written_page(State(shelf): State<Shelf>, UrlPath((name, file)): UrlPath<(String, String)>) -> Response {
    if !PAGES.contains(&file.as_str()) {
        return refusal(StatusCode::NOT_FOUND, "there is no such page");
    }
    match shelf.folder(&name).map(|folder| softdock_input::read_text(&folder.path.join(file), MOST_BYTES)) {
        Ok(Ok(text)) => page(text),
        Ok(Err(error)) => refusal(StatusCode::NOT_FOUND, error.to_string()),
        Err(refused) => *refused,
    }
}
