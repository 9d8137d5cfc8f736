//! A designed motion: inside every limit, better than chance, and at rest where it begins.

use crate::kr300;
use softdock_analysis::PageOrigin;
use softdock_identify::excitation::{DesignOptions, design};
use softdock_identify::motion_page::page;

#[test]
fn designed_motion_is_within_limits_and_better_than_random() {
    let robot = kr300();
    let options = DesignOptions { starts: 20, steps: 60, ..DesignOptions::default() };
    let found = design(&robot, &options).expect("a motion");
    assert!(found.condition < 0.5 * found.random_condition, "{} {}", found.condition, found.random_condition);
    assert!(found.uses.greatest() <= 1.0, "{:?}", found.uses);
    for (series, joint) in found.joints.iter().zip(&robot.model.joints) {
        let limits = &joint.limits;
        for k in 0..5000 {
            let [q, v, a] = series.at(options.period * f64::from(k) / 5000.0);
            assert!((limits.lower..=limits.upper).contains(&q), "{q}");
            assert!(v.abs() <= limits.speed && a.abs() <= limits.acceleration, "{v} {a}");
        }
        let [_, v, a] = series.at(0.0);
        assert!(v.abs() < 1e-12 && a.abs() < 1e-12, "the motion begins at rest");
    }
    let again = design(&robot, &options).expect("a motion");
    assert_eq!(again.condition, found.condition, "the same seed gives the same motion");
}

#[test]
fn page_shows_names_as_text_alone() {
    let mut robot = kr300();
    robot.title = "<script>title</script>".to_owned();
    for joint in &mut robot.joints {
        joint.name = "<img src=x onerror=\"run()\">".to_owned();
    }
    let options = DesignOptions { starts: 1, steps: 1, ..DesignOptions::default() };
    let found = design(&robot, &options).expect("a motion");
    let origin = PageOrigin { version: "0", commit: "<b>unknown", command: "softdock identify robot <b>" };
    let page = page(&robot, &found, &origin).expect("a page");
    assert_eq!(page.matches("<script").count(), 1, "the page's own script");
    for markup in ["<img", "<b>"] {
        assert!(!page.contains(markup), "{markup}");
    }
    assert!(page.contains("&lt;script&gt;title") && page.contains("&lt;img src=x onerror="));
}
