//! The operator's full screen, for a terminal of 80 columns and 24 lines or more.

use super::lines::micros;
use super::model::{Percentiles, View};
use crate::drive::feed::RobotSample;
use crate::log::codes::{LimitKind, Phase, StopCause};
use crate::log::record::TOOL;
use crate::signals::{AXES, axis_name};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, LineGauge, Paragraph, Sparkline};

/// Share of a limit from which it is shown as near.
const NEAR: f64 = 0.8;

/// Draws the whole screen.
pub fn draw(frame: &mut Frame, view: &View) {
    let areas = Layout::vertical([
        Constraint::Length(3),
        Constraint::Min(4),
        Constraint::Length(6),
        Constraint::Length(9),
        Constraint::Length(2),
    ]);
    let [head, force, state, limits, foot] = areas.areas(frame.area());
    draw_head(frame, head, view);
    draw_force(frame, force, view);
    let [loop_area, timing] = Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]).areas(state);
    draw_loop(frame, loop_area, view);
    draw_timing(frame, timing, view);
    let robots: [Rect; 2] = Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]).areas(limits);
    for (robot, area) in robots.into_iter().enumerate() {
        draw_limits(frame, area, view, robot);
    }
    draw_foot(frame, foot, view);
}

/// Green far from a limit, yellow near it, red at it.
fn colour(share: f64) -> Color {
    match share {
        share if share >= 1.0 || share.is_nan() => Color::Red,
        share if share >= NEAR => Color::Yellow,
        _ => Color::Green,
    }
}

fn draw_head(frame: &mut Frame, area: Rect, view: &View) {
    let now = &view.newest;
    let phase = match now.phase {
        Phase::Stopping | Phase::Stopped => Style::new().fg(Color::White).bg(Color::Red),
        Phase::Contact => Style::new().fg(Color::Black).bg(Color::Yellow),
        _ => Style::new().fg(Color::Black).bg(Color::Green),
    };
    let armed = if now.armed { "ARMED: robots move".red().bold() } else { "dry run: robots hold".green() };
    let line = Line::from(vec![
        Span::styled(format!(" {} ", now.phase.word().replace('_', " ")), phase.add_modifier(Modifier::BOLD)),
        Span::raw(format!("  {:.3} s  cycle {}  ", now.time.seconds(), now.cycle)),
        armed,
    ]);
    frame.render_widget(Paragraph::new(line).block(Block::bordered().title(" softdock drive ")), area);
}

fn draw_force(frame: &mut Frame, area: Rect, view: &View) {
    let now = &view.newest;
    let title = format!(
        " measured force {:.1} N (peak {:.1}, limit {}), moment {:.2} N m ",
        now.force, view.peak_measured_force, view.budgets.force_n, now.moment
    );
    let block = Block::bordered().title(title);
    let bars = usize::from(block.inner(area).width);
    // Millinewtons: the widget's bars are integers.
    let data: Vec<u64> = view.force_history(bars).map(|force| (force * 1e3) as u64).collect();
    let scale = (view.peak_measured_force * 1e3).max(1_000.0) as u64;
    let style = Style::new().fg(colour(now.force / view.budgets.force_n));
    frame.render_widget(Sparkline::default().block(block).data(data).max(scale).style(style), area);
}

fn draw_loop(frame: &mut Frame, area: Rect, view: &View) {
    let now = &view.newest;
    let block = Block::bordered().title(" loop ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let [text, energy] = Layout::vertical([Constraint::Length(3), Constraint::Length(1)]).areas(inner);
    let lines = vec![
        Line::raw(format!("tracking error robot 1  {:8.3} mm", now.tracking[0] * 1e3)),
        Line::raw(format!("tracking error robot 2  {:8.3} mm", now.tracking[1] * 1e3)),
        Line::raw(format!("age of sensor sample    {:8.2} ms", now.sensor_age.0 as f64 * 1e-6)),
    ];
    frame.render_widget(Paragraph::new(lines), text);
    let share = now.energy / view.budgets.energy_j;
    let label = format!("energy {:.3}/{} J", now.energy, view.budgets.energy_j);
    frame.render_widget(bar(share, label), energy);
}

/// Returns a bar that is full at the limit.
fn bar(share: f64, label: String) -> LineGauge<'static> {
    let ratio = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let gauge = LineGauge::default().ratio(ratio).label(label).filled_symbol("█").unfilled_symbol("·");
    gauge.filled_style(Style::new().fg(colour(share))).unfilled_style(Style::new().fg(Color::DarkGray))
}

fn draw_timing(frame: &mut Frame, area: Rect, view: &View) {
    let row = |name: &str, times: Percentiles| {
        let Percentiles { p50, p99, max } = times;
        Line::raw(format!("{name:14}{:>7}{:>7}{:>8}", micros(p50), micros(p99), micros(max)))
    };
    let now = &view.newest;
    let both = |count: fn(&RobotSample) -> u64| now.robots.iter().map(count).fold(0, u64::saturating_add);
    let counts = format!(
        "lost {} stale {} late {} over {}",
        both(|robot| robot.lost),
        both(|robot| robot.stale),
        both(|robot| robot.late),
        now.overruns
    );
    let any = now.overruns > 0 || now.robots.iter().any(|robot| robot.lost > 0 || robot.stale > 0 || robot.late > 0);
    let mut lines = vec![Line::from(format!("{:14}{:>7}{:>7}{:>8}", "us", "p50", "p99", "max").dim())];
    // The master's lateness is the loop's; each link has its own round trip.
    lines.push(row("lateness", view.lateness(0)));
    lines.push(row("round trip 1", view.round_trip(0)));
    lines.push(row("round trip 2", view.round_trip(1)));
    let title = Line::from(if any { counts.yellow() } else { counts.into() });
    let block = Block::bordered().title(" timing ").title_bottom(title);
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

fn draw_limits(frame: &mut Frame, area: Rect, view: &View, robot: usize) {
    let sample = &view.newest.robots[robot];
    let mut block = Block::bordered().title(format!(" limits of robot {} ", robot + 1));
    if let Some(words) = words(view.met(robot, TOOL)) {
        block = block.title_bottom(Line::from(format!(" tool: {words} ").red()));
    }
    let inner = block.inner(area);
    frame.render_widget(block, area);
    if !sample.present {
        frame.render_widget(Paragraph::new("no robot"), inner);
        return;
    }
    let rows: [Rect; AXES] = Layout::vertical([Constraint::Length(1); AXES]).areas(inner);
    for (axis, row) in rows.into_iter().enumerate() {
        let name = axis_name(axis);
        let share = sample.limit_used[axis];
        if share.is_nan() {
            frame.render_widget(Paragraph::new(format!("{name}  -").dim()), row);
            continue;
        }
        let met = words(view.met(robot, axis)).map(|words| format!(" {words}")).unwrap_or_default();
        frame.render_widget(bar(share, format!("{name:6} {:3.0} %{met}", share * 100.0)), row);
    }
}

/// Returns the words of the limits that clamped commands, if any.
fn words(met: impl Iterator<Item = LimitKind>) -> Option<String> {
    let words: Vec<&str> = met.map(LimitKind::word).collect();
    (!words.is_empty()).then(|| words.join(" "))
}

fn draw_foot(frame: &mut Frame, area: Rect, view: &View) {
    let now = &view.newest;
    let cause = match (now.cause, view.stops) {
        (StopCause::None, 0) => Line::raw(""),
        (StopCause::None, _) => Line::from("stop requested".yellow().bold()),
        (StopCause::Completed, _) => Line::from("completed".green().bold()),
        (cause, _) => Line::from(format!("stop: {}", cause.meaning()).red().bold()),
    };
    let keys = match (view.over, view.stops) {
        (true, _) => "q  close",
        (false, 0) if now.phase == Phase::Ready => {
            "every check has passed.   g  GO: the robots move   s  stop (no emergency stop)"
        }
        (false, 0) => "s or space  controlled stop (no emergency stop)",
        (false, _) => "s again  end the protocols at once (no emergency stop)",
    };
    let lost = match now.log_dropped {
        0 => Span::raw(""),
        lost => format!("   the log has lost {lost} records").red(),
    };
    let lines = vec![cause, Line::from(vec![keys.dim(), lost])];
    frame.render_widget(Paragraph::new(lines), area);
}
