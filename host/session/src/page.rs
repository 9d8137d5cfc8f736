//! The operator's page of a session: checks, GO, stop and state in a browser on this machine.
//!
//! The page can move robots. It is served on loopback only, to requests that name this address, and accepts a command
//! only with the page's own token: no other page in the same browser can send one.

use crate::answer::{SessionAnswer, StopReason};
use crate::error::{Result, SessionError};
use crate::plan::{SessionPlan, since_epoch};
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde_json::{Value, json};
use softdock_analysis::STYLE;
use softdock_campaign::rules;
use softdock_realtime::drive::checklist::{Check, CheckOutcome};
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::log::codes::{Phase, StopCause};
use softdock_realtime::signals::{AXES, axis_name};
use softdock_realtime::view::model::{Percentiles, View};
use softdock_web::{LoopbackServer, Router, WebError, refusal};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Default address of the page.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:8765";
/// Header of the page's token.
const TOKEN: &str = "x-softdock-token";
/// Bars of the force history on the page: 30 s.
const BARS: usize = 300;
/// Time in which the page may fetch the end of the session.
const LAST_LOOK: Duration = Duration::from_secs(2);

/// State shared by page and session.
pub struct PageBoard {
    controls: Arc<Controls>,
    token: String,
    state: Mutex<Value>,
    about: Mutex<Value>,
    outcome: Mutex<Value>,
    /// Whether a page is open, and has fetched the end of the session.
    watched: AtomicBool,
    has_seen_end: AtomicBool,
}

/// The operator's page of one session, served until dropped; an open page then has a moment to fetch the end of the
/// session.
pub struct OperatorPage {
    board: Arc<PageBoard>,
    server: LoopbackServer,
}

impl OperatorPage {
    /// Serves the page of a session at a loopback address; GO and stop go to `controls`.
    ///
    /// # Errors
    /// If the address is not on loopback, or cannot be bound.
    pub fn serve(address: &str, controls: &Arc<Controls>, plan: &SessionPlan) -> Result<Self> {
        let remedy = "write --serve 127.0.0.1:8765; to open it from another machine, forward that port with ssh";
        let board = Arc::new(PageBoard {
            controls: Arc::clone(controls),
            token: token()?,
            state: Mutex::new(Value::Null),
            about: Mutex::new(about(plan)?),
            outcome: Mutex::new(Value::Null),
            watched: AtomicBool::new(false),
            has_seen_end: AtomicBool::new(false),
        });
        // A failed page requests no stop: keys and signals still do.
        let server = LoopbackServer::start(address, "operator page", router(Arc::clone(&board))).map_err(|error| {
            let reason = if matches!(error, WebError::NotLoopback(_)) { ", and the page can move robots" } else { "" };
            SessionError::refused(format!("{error}{reason}"), remedy)
        })?;
        Ok(Self { board, server })
    }

    /// Returns the address of the page.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }

    /// Returns the board that the session writes to.
    pub fn board(&self) -> &PageBoard {
        &self.board
    }
}

/// Static values of a session for the page.
fn about(plan: &SessionPlan) -> Result<Value> {
    let (task, station) = (plan.task(), &plan.task().station);
    let robots = station.robots.iter().zip(plan.addresses().all());
    let robots = robots
        .enumerate()
        .map(|(index, (robot, address))| format!("Robot {}: {}, {}", index + 1, robot.name, address.shown()));
    let links = &station.links;
    Ok(json!({
        "campaign": plan.campaign().id, "run": task.run, "mode": plan.mode_text(), "armed": task.armed,
        "began_unix_s": since_epoch()?.seconds(), "robots": robots.collect::<Vec<_>>(),
        "rules": rules::in_force(&task.plant.facility),
        "links": format!(
            "links: more than {} successive lost or untaken cycles, more than {} in {} s; a tool more than {:.1} mm + {} s x \
             commanded speed from its command; sensor older than {:.1} ms",
            links.hold_cycles, links.window_cycles, links.window, links.tracking.distance * 1e3, links.tracking.time,
            links.sensor_age * 1e3,
        ),
    }))
}

/// Returns 128 random bits.
fn token() -> Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| SessionError::refused(format!("no random numbers: {error}"), "run without --serve"))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

impl Drop for OperatorPage {
    fn drop(&mut self) {
        let begun = Instant::now();
        while self.board.watched.load(Ordering::Relaxed)
            && !self.board.has_seen_end.load(Ordering::Relaxed)
            && begun.elapsed() < LAST_LOOK
        {
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl PageBoard {
    /// Shows the state of the session.
    pub fn show(&self, view: &View) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = state(view);
    }

    /// Shows the end of the session.
    pub fn finish(&self, answer: &SessionAnswer) {
        *self.outcome.lock().unwrap_or_else(PoisonError::into_inner) = json!(answer);
    }

    fn picture(&self) -> Value {
        let read = |value: &Mutex<Value>| value.lock().unwrap_or_else(PoisonError::into_inner).clone();
        json!({ "state": read(&self.state), "outcome": read(&self.outcome), "about": read(&self.about) })
    }
}

fn router(board: Arc<PageBoard>) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/state", get(picture))
        .route("/go", post(go))
        .route("/stop", post(stop))
        .layer(from_fn_with_state(Arc::clone(&board), only_with_token))
        .with_state(board)
}

/// A command needs the token of the page: a foreign page does not know it.
async fn only_with_token(State(board): State<Arc<PageBoard>>, request: Request, next: Next) -> Response {
    let token = request.headers().get(TOKEN).and_then(|token| token.to_str().ok()).unwrap_or_default();
    if request.method() == axum::http::Method::POST && token != board.token {
        return refusal(StatusCode::FORBIDDEN, "a command needs the token of the page");
    }
    next.run(request).await
}

async fn page(State(board): State<Arc<PageBoard>>) -> Response {
    let text =
        include_str!("operator_page.html").replace("/* STYLE */", STYLE).replace("TOKEN_OF_THIS_SESSION", &board.token);
    softdock_web::page(text)
}

async fn picture(State(board): State<Arc<PageBoard>>) -> Response {
    board.watched.store(true, Ordering::Relaxed);
    let picture = board.picture();
    if !picture["outcome"].is_null() && picture["state"]["over"] == json!(true) {
        board.has_seen_end.store(true, Ordering::Relaxed);
    }
    softdock_web::answer(&picture)
}

async fn go(State(board): State<Arc<PageBoard>>) -> Response {
    if board.picture()["state"]["phase"] != json!(Phase::Ready.word()) {
        return refusal(StatusCode::CONFLICT, "GO was refused: a check is open again, or the session is past it");
    }
    board.controls.go();
    StatusCode::NO_CONTENT.into_response()
}

async fn stop(State(board): State<Arc<PageBoard>>) -> Response {
    board.controls.request_stop();
    StatusCode::NO_CONTENT.into_response()
}

/// Converts a number for the page; an unknown one is null.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

fn micros(times: Percentiles) -> Value {
    let micros = |time: softdock_realtime::time::Nanos| time.0 / 1000;
    json!({ "p50": micros(times.p50), "p99": micros(times.p99), "max": micros(times.max) })
}

fn check(check: &Check) -> Value {
    let (row, answer) = (check.kind.row(), check.answer());
    json!({
        "id": row.id, "subject": check.subject(), "title": row.title, "answer": answer.word(),
        "value": check.value_text(), "limit": check.limit_text(),
        "remedy": if answer == CheckOutcome::Failed { row.remedy } else { "" },
    })
}

/// Converts a view for the page.
fn state(view: &View) -> Value {
    let now = &view.newest;
    // Before the run the parts are not at their simulated poses.
    let runs = matches!(now.phase, Phase::Approach | Phase::Contact | Phase::Free | Phase::Captured | Phase::Stopping);
    let robot = |r: usize| {
        let robot = &now.robots[r];
        let axes = (0..AXES).filter(|axis| robot.limit_used[*axis].is_finite()).map(|axis| {
            let met: Vec<&str> = view.met(r, axis).map(|kind| kind.word()).collect();
            json!({ "axis": axis_name(axis), "share": robot.limit_used[axis], "met": met })
        });
        json!({
            "present": robot.present, "lost": robot.lost, "stale": robot.stale, "late": robot.late,
            "tracking_mm": number(if runs { now.tracking[r] * 1e3 } else { f64::NAN }), "axes": axes.collect::<Vec<_>>(),
            "lateness_us": micros(view.lateness(r)), "round_trip_us": micros(view.round_trip(r)),
        })
    };
    let notice = &view.notice;
    json!({
        "time_s": now.time.seconds(), "cycle": now.cycle, "phase": now.phase.word(), "meaning": now.phase.meaning(),
        "armed": now.armed, "over": view.over, "stops": view.stops,
        "cause": now.cause.word(), "cause_meaning": now.cause.meaning(),
        "is_stopped": now.cause != StopCause::None,
        "force_n": number(now.force), "moment_nm": number(now.moment), "peak_force_n": number(view.peak_measured_force),
        "force_limit_n": number(view.budgets.force_n), "energy_j": number(now.energy),
        "energy_limit_j": number(view.budgets.energy_j), "sensor_age_ms": number(now.sensor_age.seconds() * 1e3),
        "overruns": now.overruns, "log_dropped": now.log_dropped,
        "bars": view.force_history(BARS).map(number).collect::<Vec<_>>(),
        "robots": [robot(0), robot(1)],
        "checks": notice.checklist.checks().iter().map(check).collect::<Vec<_>>(),
        "refusal": notice.refusal.map(|refusal| refusal.to_string()),
        "stop": notice.stopped.map(|(time, alarm)| StopReason::new(time, alarm)), "retracted_mm": notice.retracted.map(|distance| distance * 1e3),
    })
}
