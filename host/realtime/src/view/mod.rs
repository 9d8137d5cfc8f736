//! The operator's view of a session: phase, force, tracking, energy, timing, limits; and the stop key.
//!
//! The cycle writes a small [`Sample`](crate::drive::feed::Sample) to a ring and never waits; the view reads all of
//! them, so that percentiles cover every cycle. On a terminal it is a full [`screen`], elsewhere one of [`lines`] per
//! second.

pub mod lines;
pub mod model;
pub mod screen;

use crate::drive::controls::Controls;
use crate::drive::feed::Samples;
use crate::log::codes::Phase;
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use model::{Budgets, View};
use ratatui::crossterm;
use std::io::{self, IsTerminal, Write};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two frames of the screen.
const PICTURE: Duration = Duration::from_millis(100);
/// Time between two lines without a terminal.
const LINE: Duration = Duration::from_secs(1);

/// Shows a session until it is over and, on a terminal, the operator has closed the view; returns the last state.
///
/// `watch` receives the view at each frame, ten times a second, and once after the last sample. Run this on a thread of
/// normal priority. A failed view (the terminal is closed) requests no stop; the caller decides.
///
/// # Errors
/// If standard output cannot be written.
pub fn show(
    mut samples: Samples,
    budgets: Budgets,
    controls: &Controls,
    watch: &mut dyn FnMut(&View),
) -> io::Result<View> {
    let mut view = View::new(budgets);
    if io::stdout().is_terminal() && io::stdin().is_terminal() {
        show_screen(&mut view, &mut samples, controls, watch)?;
    } else {
        show_lines(&mut view, &mut samples, controls, &mut io::stdout(), watch)?;
    }
    Ok(view)
}

/// Restores the terminal on drop.
struct Restore;

impl Drop for Restore {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

fn show_screen(
    view: &mut View,
    samples: &mut Samples,
    controls: &Controls,
    watch: &mut dyn FnMut(&View),
) -> io::Result<()> {
    // Raw mode turns Ctrl+C into a key: it causes no signal.
    let mut terminal = ratatui::try_init()?;
    let _restore = Restore;
    loop {
        let over = take(view, samples, controls);
        watch(view);
        terminal.draw(|frame| screen::draw(frame, view))?;
        if over && controls.close_requested() {
            return Ok(());
        }
        if !event::poll(PICTURE)? {
            continue;
        }
        if let Event::Key(key) = event::read()? {
            match meaning(key, over) {
                Some(Key::Stop) => controls.request_stop(),
                Some(Key::Close) => return Ok(()),
                Some(Key::Go) if view.newest.phase == Phase::Ready => controls.go(),
                Some(Key::Go) => {}
                None => {}
            }
        }
    }
}

/// Action of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Key {
    Go,
    Stop,
    Close,
}

/// `g` is GO; `s`, space and Ctrl+C stop; `q` and Ctrl+C close the view, only after the session is over.
fn meaning(key: KeyEvent, over: bool) -> Option<Key> {
    if key.kind != KeyEventKind::Press {
        return None;
    }
    let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
    match key.code {
        KeyCode::Char('q' | 'Q') if over => Some(Key::Close),
        KeyCode::Char('g' | 'G') if !over => Some(Key::Go),
        _ if control_c => Some(if over { Key::Close } else { Key::Stop }),
        KeyCode::Char('s' | 'S' | ' ') if !over => Some(Key::Stop),
        _ => None,
    }
}

fn show_lines(
    view: &mut View,
    samples: &mut Samples,
    controls: &Controls,
    out: &mut impl Write,
    watch: &mut dyn FnMut(&View),
) -> io::Result<()> {
    let mut last = Instant::now();
    loop {
        let over = take(view, samples, controls);
        watch(view);
        if over || last.elapsed() >= LINE {
            writeln!(out, "{}", lines::line(view))?;
            out.flush()?;
            last = Instant::now();
        }
        if over {
            return Ok(());
        }
        thread::sleep(PICTURE);
    }
}

/// Takes the new samples; returns true once the session is over and all of them are read.
fn take(view: &mut View, samples: &mut Samples, controls: &Controls) -> bool {
    let over = controls.ended() || samples.is_abandoned();
    while let Some(sample) = samples.next_sample() {
        view.take(&sample);
    }
    while let Some(notice) = samples.next_notice() {
        view.notice = notice;
    }
    view.set_controls(controls.stops(), over);
    over
}

#[cfg(test)]
mod tests;
