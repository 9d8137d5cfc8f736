//! What the operator sees of a drive: phase, force, tracking, energy, timing, limits; and the stop key.
//!
//! The cycle hands a small [`Sample`](crate::drive::feed::Sample) to a ring and never waits; the view reads all of them, so that percentiles count
//! every cycle. On a terminal it is a full [`screen`], elsewhere one of [`lines`] each second.

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

/// Time between two pictures.
const PICTURE: Duration = Duration::from_millis(100);
/// Time between two lines where there is no terminal.
const LINE: Duration = Duration::from_secs(1);

/// Shows a drive until it is over and, on a terminal, the operator has seen how it ended; gives what was shown last.
///
/// `watch` sees the view at each picture, ten times a second, and once when all of the drive has been seen.
/// Run it on a thread of normal priority. A view that fails (the terminal is gone) asks for no stop; the caller
/// decides.
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

/// Gives the terminal back however the view ends.
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
    // The terminal's raw mode turns Ctrl+C into a key: no signal comes from it.
    let mut terminal = ratatui::try_init()?;
    let _restore = Restore;
    loop {
        let over = take(view, samples, controls);
        watch(view);
        terminal.draw(|frame| screen::draw(frame, view))?;
        if over && controls.leaves() {
            return Ok(());
        }
        if !event::poll(PICTURE)? {
            continue;
        }
        if let Event::Key(key) = event::read()? {
            match meaning(key, over) {
                Some(Key::Stop) => controls.request_stop(),
                Some(Key::Leave) => return Ok(()),
                Some(Key::Go) if view.newest.phase == Phase::Ready => controls.go(),
                Some(Key::Go) => {}
                None => {}
            }
        }
    }
}

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Key {
    Go,
    Stop,
    Leave,
}

/// `g` lets the robots move; `s`, space and Ctrl+C stop; `q` and Ctrl+C leave once the drive is over, and never before.
fn meaning(key: KeyEvent, over: bool) -> Option<Key> {
    if key.kind != KeyEventKind::Press {
        return None;
    }
    let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
    match key.code {
        KeyCode::Char('q' | 'Q') if over => Some(Key::Leave),
        KeyCode::Char('g' | 'G') if !over => Some(Key::Go),
        _ if control_c => Some(if over { Key::Leave } else { Key::Stop }),
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

/// Takes what has come; true once the drive is over and all of it is seen.
fn take(view: &mut View, samples: &mut Samples, controls: &Controls) -> bool {
    let over = controls.ended() || samples.is_abandoned();
    while let Some(sample) = samples.next_sample() {
        view.take(&sample);
    }
    while let Some(notice) = samples.next_notice() {
        view.notice = notice;
    }
    view.told(controls.stops(), over);
    over
}

#[cfg(test)]
mod tests;
