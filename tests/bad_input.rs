//! Damaged campaign, scenario, model and table files: each message states file, line, key and remedy.
//!
//! `data/bad` contains one valid set of files; every case damages one place in one of them.

use std::fs;
use std::path::{Path, PathBuf};

/// Damaged file.
struct Case {
    /// File that is damaged.
    file: &'static str,
    /// Text that is replaced, once.
    old: &'static str,
    /// Replacement.
    new: &'static str,
    /// File, line and key of the first problem.
    place: (&'static str, usize, &'static str),
    /// Required part of the message.
    message: &'static str,
    /// Required part of the remedy.
    remedy: &'static str,
}

const CAMPAIGN: &str = "campaign.toml";
const SCENARIO: &str = "scenario.toml";
const ARM: &str = "arm.urdf";
const TABLE: &str = "delays.csv";
const COVARIANCE: &str = "offsets.csv";

const fn campaign(
    old: &'static str,
    new: &'static str,
    line: usize,
    key: &'static str,
    message: &'static str,
    remedy: &'static str,
) -> Case {
    Case { file: CAMPAIGN, old, new, place: (CAMPAIGN, line, key), message, remedy }
}

const fn scenario(
    old: &'static str,
    new: &'static str,
    line: usize,
    key: &'static str,
    message: &'static str,
    remedy: &'static str,
) -> Case {
    Case { file: SCENARIO, old, new, place: (SCENARIO, line, key), message, remedy }
}

const fn arm(
    old: &'static str,
    new: &'static str,
    line: usize,
    key: &'static str,
    message: &'static str,
    remedy: &'static str,
) -> Case {
    Case { file: ARM, old, new, place: (ARM, line, key), message, remedy }
}

const fn table(old: &'static str, new: &'static str, line: usize, message: &'static str, remedy: &'static str) -> Case {
    Case { file: TABLE, old, new, place: (TABLE, line, "delay_ms"), message, remedy }
}

#[rustfmt::skip]
const CAMPAIGNS: &[Case] = &[
    campaign("campaign/2", "campaign/9", 1, "schema", "does not read this format", "schema = \"campaign/2\""),
    campaign("campaign/2", "campaign/1", 1, "schema", "does not read this format", "each [[requirement]] has its subject"),
    campaign("id = \"valid\"", "id = \"a/b\"", 2, "id", "cannot be a name", "letters, digits, - and _"),
    campaign("seed = 7\n", "", 1, "seed", "must be there", "add seed = 20261121"),
    campaign("seed = 7", "seed = -7", 4, "seed", "does not fit", "a whole number, not negative"),
    campaign("runs = 100", "runs = 0", 5, "runs", "out of range", "from 1 to 1000000000"),
    campaign("runs = 100", "runs = 99999999999999", 5, "runs", "out of range", "from 1 to 1000000000"),
    campaign("runs = 100", "runs = \"many\"", 5, "runs", "string \"many\"", "a whole number"),
    campaign("runs = 100", "runs = 100\nrums = 3", 6, "rums", "no key `rums`", "did you mean `runs`?"),
    campaign("runs = 100", "runs = 100\nruns = 3", 6, "runs", "not TOML", "a key occurs once"),
    campaign("scenario.toml", "missing.toml", 6, "scenario", "there is no file", "relative to the file that names it"),
    campaign("\"scenario.toml\"", "\".\"", 6, "scenario", "is a directory", "name a file in it"),
    campaign("\"cpu\"", "\"cqu\"", 7, "execution.backend", "`cqu` is not known", "did you mean `cpu`?"),
    campaign("\"1 %\"", "\"101 %\"", 7, "execution.parity", "1.01 is out of range", "at least 0, at most 1"),
    campaign("parity = \"1 %\"", "half_step = 2", 7, "execution.half_step", "2 is out of range", "at least 0, at most 1"),
    campaign("\"random\"", "\"sobl\"", 8, "sampling.method", "`sobl` is not known", "did you mean `sobol`?"),
    campaign("runs = 100\nscenario = \"scenario.toml\"\nexecution = { backend = \"cpu\", parity = \"1 %\" }\nsampling = { method = \"random\" }", "runs = 65537\nscenario = \"scenario.toml\"\nexecution = { backend = \"cpu\", parity = \"1 %\" }\nsampling = { method = \"sobol\" }", 8, "sampling.method", "a Sobol' sequence has 65536 points", "lower runs, or write method = \"lhs\""),
    campaign("target = \"contact_stiffness\"", "target = \"contact_stifness\"", 11, "dispersion[1].target", "no parameter", "did you mean `contact_stiffness`?"),
    campaign("target = \"contact_stiffness\"", "targe = \"contact_stiffness\"", 11, "dispersion[1].targe", "no key `targe`", "did you mean `target`?"),
    campaign("min = \"1e4 N/m\"", "min = \"1e4 mm\"", 12, "dispersion[1].dist.min", "this is a length, not a stiffness", "write \"10000 N/m\""),
    campaign("min = \"1e4 N/m\"", "min = 1e4", 12, "dispersion[1].dist.min", "a stiffness needs its unit", "write \"10000 N/m\""),
    campaign("min = \"1e4 N/m\"", "min = \"1e4 kgf/mm\"", 12, "dispersion[1].dist.min", "`kgf` is not read", "1 kgf is 9.80665 N"),
    campaign("min = \"1e4 N/m\"", "min = \"0 N/m\"", 12, "dispersion[1].dist.min", "0 N/m is out of range", "above 0 N/m"),
    campaign("min = \"1e4 N/m\"", "min = nan", 12, "dispersion[1].dist.min", "not a finite number", "write \"1.5 N/m\""),
    campaign("max = \"1e5 N/m\"", "max = \"1e3 N/m\"", 12, "dispersion[1].dist.max", "max is not above min", "write max above min (10000 N/m)"),
    campaign("max = \"1e5 N/m\"", "max = \"1e11 N/m\"", 12, "dispersion[1].dist", "contact pair: stiffness", "write timing.substep ="),
    campaign("\"loguniform\"", "\"logunifrom\"", 12, "dispersion[1].dist.kind", "is not known", "did you mean `loguniform`?"),
    campaign("\"loguniform\"", "\"normal\"", 12, "dispersion[1].dist.kind", "`normal` needs the key `mean`", "`normal` takes: mean, sigma"),
    campaign("max = 0.45", "max = -0.1", 16, "dispersion[2].dist.max", "-0.1 is out of range", "at least 0, at most 10"),
    campaign("mean = 0.18", "mean = inf", 16, "dispersion[2].dist.mean", "not a finite number", "write 1.5"),
    campaign("\"epistemic\"", "\"epistemc\"", 17, "dispersion[2].class", "is not known", "did you mean `epistemic`?"),
    campaign("[outer]\ndraws = 4", "", 16, "dispersion[2].dist", "there is no outer loop", "draws = 20"),
    campaign("target = \"offset\"", "target = \"offset_q\"", 20, "dispersion[3].target", "no parameter `offset_q`", "did you mean `offset_x`, `offset_y` or `offset_z`?"),
    campaign("sigma = [\"1 mm\", \"2 mm\", \"3 mm\"]", "sigma = [\"1 mm\", \"2 mm\"]", 21, "dispersion[3].dist.sigma", "2 values for 3 targets", "write 3 values in brackets"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"triangular\", min = \"1e4 N/m\", max = \"1e5 N/m\"", 12, "dispersion[1].dist.kind", "`triangular` needs the key `mode`", "`triangular` takes: min, mode, max"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"triangular\", min = \"1e4 N/m\", mode = \"2e5 N/m\", max = \"1e5 N/m\"", 12, "dispersion[1].dist.mode", "mode 200000 N/m is not from min to max", "write mode from 10000 N/m to 100000 N/m"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"beta\", a = 0, b = 2, min = \"1e4 N/m\", max = \"1e5 N/m\"", 12, "dispersion[1].dist.a", "0 is out of range", "at least 0.1, at most 1000"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"beta\", a = 1, b = 2, min = \"1e5 N/m\", max = \"1e4 N/m\"", 12, "dispersion[1].dist.max", "max is not above min", "write max above min"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"weibull\", scale = \"1e5 N/m\", shape = 0.2", 12, "dispersion[1].dist", "beyond its legal range", "lower scale, raise shape, or use kind = "),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"weibull\", scale = \"1e5 mm\", shape = 2", 12, "dispersion[1].dist.scale", "this is a length, not a stiffness", "N/m"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"arcsine\", min = \"1e4 N/m\"", 12, "dispersion[1].dist.kind", "`arcsine` needs the key `max`", "`arcsine` takes: min, max"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"discrete\", values = [\"1e4 N/m\"]", 12, "dispersion[1].dist.values", "two values or more", "use kind = "),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"discrete\", values = [\"1e4 N/m\", \"2e4 N/m\"], weights = [1]", 12, "dispersion[1].dist.weights", "1 values where 2 belong", "write 2 values in brackets"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"discrete\", values = [\"1e4 N/m\", \"2e4 N/m\"], weights = [1, 0]", 12, "dispersion[1].dist.weights[2]", "0 is out of range", "above 0"),
    campaign("kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e5 N/m\"", "kind = \"discrete\", values = [\"1e4 N/m\", \"10 kN/m\"]", 12, "dispersion[1].dist.values[2]", "the value 10000 N/m occurs twice", "write it once"),
    campaign("sigma = [\"1 mm\", \"2 mm\", \"3 mm\"]", "covariance = \"none.csv\"", 21, "dispersion[3].dist.covariance", "there is no file", "relative to the file that names it"),
    campaign("sigma = [\"1 mm\", \"2 mm\", \"3 mm\"]", "covariance = \"offsets.csv\", unit = \"kg\"", 21, "dispersion[3].dist.unit", "this is not a unit of `offset_x`", "or remove `unit`"),
    campaign("sigma = [\"1 mm\", \"2 mm\", \"3 mm\"]", "covariance = \"offsets.csv\", sigma = [\"1 mm\", \"2 mm\", \"3 mm\"]", 21, "dispersion[3].dist.sigma", "`sigma` is in the covariance file already", "remove `covariance`"),
    campaign("sigma = [\"1 mm\", \"2 mm\", \"3 mm\"]", "", 21, "dispersion[3].dist.kind", "`mvnormal` needs the key `sigma`", "covariance"),
    campaign("kind = \"mvnormal\"", "kind = \"normal\"", 20, "dispersion[3].target", "`offset` is a vector", "\"offset_x\", \"offset_y\" or \"offset_z\""),
    campaign("delays.csv", "delays.parquet", 25, "dispersion[4].dist.file", "only CSV", "Parquet tables are not read here"),
    campaign("unit = \"ms\"", "unit = \"mm\"", 25, "dispersion[4].dist.unit", "not a unit of the target", "s, ms, us, ns, min"),
    campaign("sigma = \"10 kg\"", "sigma = \"100 kg\"", 29, "dispersion[5].dist", "beyond its legal range", "kind = \"truncnormal\""),
    campaign("target = \"target_mass\"", "target = \"loop_delay\"", 28, "dispersion[5].target", "dispersed twice", "the one in line 25"),
    campaign("matrix = [[1, 0.5], [0.5, 1]]", "matrix = [[1, 0.5], [0.4, 1]]", 33, "correlation[1].matrix", "not a correlation matrix", "symmetric, with ones on the diagonal"),
    campaign("matrix = [[1, 0.5], [0.5, 1]]", "matrix = [[1, 1], [1, 1]]", 33, "correlation[1].matrix", "not positive definite", "weaken the correlations"),
    campaign("\"target_mass\"]", "\"base_mass\"]", 32, "correlation[1].targets[2]", "is not dispersed", "add a [[dispersion]]"),
    campaign("2/3 * contact_stiffness", "2/3 * bristle_damping", 37, "derived[1].expr", "bristle_stiffness -> bristle_damping -> bristle_stiffness", "compute one of them"),
    campaign("2/3 * contact_stiffness", "2/3 * contact_stifness", 37, "derived[1].expr", "no parameter `contact_stifness`", "did you mean `contact_stiffness`?"),
    campaign("2/3 * contact_stiffness", "2/3 (contact_stiffness)", 37, "derived[1].expr", "`(` does not belong here", "a product needs its `*`"),
    campaign("bristle_stiffness / 100", "0 - bristle_stiffness", 41, "derived[2].expr", "beyond its legal range", "bound it with max"),
    campaign("draws = 4", "draws = 101", 44, "outer.draws", "101 is out of range", "from 1 to 100"),
    campaign("\"peak_contact_force\"", "\"peak_contact_forse\"", 50, "requirement[1].metric", "no metric `peak_contact_forse`", "did you mean `peak_contact_force`?"),
    campaign("\"peak_contact_force\"", "\"peak_force\"", 50, "requirement[1].metric", "no metric `peak_force`", "peak_interface_force (contact and latch)"),
    campaign("at_most = \"80 N\"", "at_most = \"80 N m\"", 51, "requirement[1].at_most", "this is a moment, not a force", "write \"80 N\""),
    campaign("at_most = \"80 N\"\n", "", 47, "requirement[1].id", "no limit", "give at_most, at_least, or both"),
    campaign("[traces]", "[[requirement]]\nid = \"req_1\"\ntext = \"t\"\nsubject = \"space\"\nmetric = \"impulse\"\nat_most = \"1 N s\"\nprobability = 0.9\nconfidence = 0.9\n[traces]", 56, "requirement[2].id", "the same columns as `REQ-1`", "an id of its own"),
    campaign("\"99 %\"", "\"100 %\"", 52, "requirement[1].probability", "1 is out of range", "above 0, at most 0.999999"),
    campaign("\"90 %\"", "90", 53, "requirement[1].confidence", "90 is out of range", "above 0, at most 0.999999"),
    campaign("subject = \"space\"\n", "", 46, "requirement[1].subject", "must be there", "add subject = \"space\" (or \"facility\", \"agreement\")"),
    campaign("subject = \"space\"", "subject = \"hil\"", 49, "requirement[1].subject", "`hil` is not known here", "facility"),
    campaign("at_most = \"80 N\"", "at_most = \"80 N\"\nat_least = \"0.1 kN\"", 52, "requirement[1].at_least", "at_least 100 N is not below at_most 80 N", "the lower limit as at_least"),
    campaign("probability = \"99 %\"\n", "", 47, "requirement[1].id", "needs its probability", "add probability = \"99 %\""),
    campaign("\"peak_contact_force\"", "\"abort_rate\"", 50, "requirement[1].metric", "no metric `abort_rate`", "a rate is judged with subject = \"agreement\""),
    campaign("subject = \"space\"\nmetric = \"peak_contact_force\"\nat_most = \"80 N\"\nprobability = \"99 %\"\n", "subject = \"agreement\"\nmetric = \"peak_contact_force\"\nat_most = \"5 %\"\n", 50, "requirement[1].metric", "`peak_contact_force` is not known here", "abort_rate"),
    campaign("subject = \"space\"\nmetric = \"peak_contact_force\"\nat_most = \"80 N\"\n", "subject = \"agreement\"\nmetric = \"abort_rate\"\nat_most = \"5 %\"\n", 52, "requirement[1].probability", "does not take `probability`", "remove it"),
    campaign("subject = \"space\"\nmetric = \"peak_contact_force\"\nat_most = \"80 N\"\nprobability = \"99 %\"\n", "subject = \"agreement\"\nmetric = \"abort_rate\"\n", 47, "requirement[1].id", "no limit", "add at_most = \"5 %\""),
    campaign("[traces]", "[[metric]]\nname = \"share\"\nunit = \"1\"\nexpr = \"impulse / effective_mass\"\n[traces]", 58, "metric[1].expr", "the expression has the unit m/s, not 1", "write unit = \"m/s\""),
    campaign("[traces]", "[[metric]]\nname = \"share\"\nunit = \"N\"\nexpr = \"peak_contact_force - 5\"\n[traces]", 58, "metric[1].expr", "it adds or compares kg m/s^2 and 1", "numbers in an expression have no unit"),
    campaign("[traces]", "[[metric]]\nname = \"share\"\nunit = \"N\"\nexpr = \"peak_contact_forse\"\n[traces]", 58, "metric[1].expr", "no metric or parameter `peak_contact_forse`", "did you mean `peak_contact_force`?"),
    campaign("[traces]", "[[metric]]\nname = \"impulse\"\nunit = \"N s\"\nexpr = \"2 * impulse\"\n[traces]", 56, "metric[1].name", "a metric or a parameter already", "choose another name"),
    campaign("[traces]", "[[metric]]\nname = \"pass_speed\"\nunit = \"m/s\"\nexpr = \"approach_speed\"\n[traces]", 56, "metric[1].name", "the runs table has columns of this name", "choose another name"),
    campaign("[traces]", "[[metric]]\nname = \"share\"\nunit = \"kN\"\nexpr = \"peak_contact_force\"\n[traces]", 57, "metric[1].unit", "no SI unit without a factor", "values are in SI"),
    campaign("[traces]", "[contact_events]\nkeep = [\"worst:5\", \"every\"]\n[traces]", 56, "contact_events.keep[2]", "names no runs", "\"all\", \"nominal\""),
    campaign("[traces]", "[contact_events]\nmerge_gap = \"1 ms\"\n[traces]", 55, "contact_events.keep", "this key must be there", "keep = [\"worst:5\", \"random:20\"]"),
    campaign("[traces]", "[contact_events]\nkeep = [\"all\"]\nmerge_gap = \"1 mm\"\n[traces]", 57, "contact_events.merge_gap", "this is a length, not a time", "write \"1 s\""),
    campaign("[traces]", "[contact_events]\nkeep = [\"all\"]\nmerge_gap = \"11 s\"\n[traces]", 57, "contact_events.merge_gap", "11 s is out of range", "at least 0 s, at most 10 s"),
    campaign("[traces]", "[contact_events]\nkep = [\"all\"]\n[traces]", 56, "contact_events.kep", "no key `kep`", "did you mean `keep`?"),
    campaign("\"worst:5\"", "\"all\"", 57, "traces.keep[2]", "names no runs", "\"nominal\", \"failed\""),
    campaign("\"worst:5\"", "\"worst\"", 57, "traces.keep[2]", "names no runs", "\"worst:20\""),
    campaign("target = \"target_mass\"\ndist = { kind = \"normal\", mean = \"400 kg\", sigma = \"10 kg\" }\n\n[[correlation]]\ntargets = [\"contact_stiffness\", \"target_mass\"]\nmatrix = [[1, 0.5], [0.5, 1]]", "target = \"rail_lag\"\ndist = { kind = \"uniform\", min = \"1 ms\", max = \"9 ms\" }", 29, "dispersion[5].dist", "`rail_lag` does nothing here: the facility has no rail", "remove it, or add a table [facility.rail] to the scenario"),
    campaign("target = \"target_mass\"\ndist = { kind = \"normal\", mean = \"400 kg\", sigma = \"10 kg\" }\n\n[[correlation]]\ntargets = [\"contact_stiffness\", \"target_mass\"]\nmatrix = [[1, 0.5], [0.5, 1]]", "target = \"rail_lag_damping\"\ndist = { kind = \"uniform\", min = 0.5, max = 1 }", 29, "dispersion[5].dist", "`rail_lag_damping` does nothing here: the facility has no rail", "add a table [facility.rail]"),
    campaign("target = \"target_mass\"\ndist = { kind = \"normal\", mean = \"400 kg\", sigma = \"10 kg\" }\n\n[[correlation]]\ntargets = [\"contact_stiffness\", \"target_mass\"]\nmatrix = [[1, 0.5], [0.5, 1]]", "target = \"contact_dissipation\"\ndist = { kind = \"uniform\", min = \"0.1 s/m\", max = \"1 s/m\" }", 29, "dispersion[5].dist", "`contact_dissipation` does nothing here: the contact law has a damping and no dissipation", "disperse `contact_damping` instead, or write law = \"power\""),
    campaign("target = \"target_mass\"\ndist = { kind = \"normal\", mean = \"400 kg\", sigma = \"10 kg\" }\n\n[[correlation]]\ntargets = [\"contact_stiffness\", \"target_mass\"]\nmatrix = [[1, 0.5], [0.5, 1]]", "target = \"robot2_lag_damping\"\ndist = { kind = \"uniform\", min = 0.5, max = 1 }", 29, "dispersion[5].dist", "`robot2_lag_damping` does nothing here: the lag of this response is always 0", "remove it, or give the response a lag above 0 s"),
    campaign("target = \"target_mass\"\ndist = { kind = \"normal\", mean = \"400 kg\", sigma = \"10 kg\" }\n\n[[correlation]]\ntargets = [\"contact_stiffness\", \"target_mass\"]\nmatrix = [[1, 0.5], [0.5, 1]]", "target = \"robot2_lag_zero\"\ndist = { kind = \"uniform\", min = \"1 ms\", max = \"9 ms\" }", 29, "dispersion[5].dist", "`robot2_lag_zero` does nothing here", "give the response a lag above 0 s"),
    campaign("target = \"bristle_stiffness\"\nexpr = \"2/3 * contact_stiffness\"\n\n[[derived]]\ntarget = \"bristle_damping\"\nexpr = \"bristle_stiffness / 100\"", "target = \"rail_lag\"\nexpr = \"loop_delay\"", 37, "derived[1].expr", "`rail_lag` does nothing here: the facility has no rail", "add a table [facility.rail]"),
    campaign("keep = [\"nominal\", \"worst:5\"]\n", "keep = [\"nominal\", ", 57, "traces.keep", "not TOML", "the file ends too early"),
];

/// Text before `[traces]` in a campaign with one variant, and in one with a comparison.
macro_rules! variant {
    ($set:literal) => {
        concat!("[[variant]]\nname = \"v\"\nset = { ", $set, " }\n[traces]")
    };
}
macro_rules! compared {
    ($table:literal) => {
        concat!("[[variant]]\nname = \"v\"\n[compare]\n", $table, "\n[traces]")
    };
}

/// Variants of the facility: keys of the scenario, places of the campaign.
#[rustfmt::skip]
const VARIANTS: &[Case] = &[
    campaign("[traces]", variant!("\"facility.loop_dely\" = \"8 ms\""), 57, "variant[1].set.facility.loop_dely", "no key `loop_dely`", "did you mean `loop_delay`?"),
    campaign("[traces]", variant!("\"facility.sensr.period\" = \"1 ms\""), 57, "variant[1].set.facility.sensr.period", "no key `sensr`", "did you mean `sensor`?"),
    campaign("[traces]", variant!("\"facility.loop_delay\" = \"8 kg\""), 57, "variant[1].set.facility.loop_delay", "this is a mass, not a time", "write \"8 s\""),
    campaign("[traces]", variant!("\"facility.robot1\" = { lag = \"0.3 ms\" }"), 57, "variant[1].set.facility.robot1.lag", "too short for a substep", "a lag of at least 0.5000 ms"),
    campaign("[traces]", variant!("\"facility.loop_delay.max\" = 3"), 57, "variant[1].set.facility.loop_delay.max", "does not fit here", "a number"),
    campaign("[traces]", variant!("\"facility.compensator\" = { kind = \"smith\", delay = \"4 ms\" }"), 57, "variant[1].set.facility.compensator.kind", "`smith` needs the key `stiffness`", "`smith` takes: delay, stiffness"),
    campaign("[traces]", variant!("\"facility.compensator\" = { delay = \"4 ms\" }"), 57, "variant[1].set.facility.compensator.kind", "this key must be there", "add kind"),
    campaign("[traces]", variant!("\"task.max_force\" = \"8 N\""), 57, "variant[1].set.task.max_force", "a variant replaces keys of the facility", "what space shares is dispersed"),
    campaign("[traces]", "[[variant]]\nname = \"v\"\n[[variant]]\nname = \"V\"\n[traces]", 58, "variant[2].name", "two variants of one name", "choose another name"),
    campaign("[traces]", "[[variant]]\nname = \"runs\"\n[traces]", 56, "variant[1].name", "the results folder holds this name already", "choose another name"),
    campaign("[traces]", "[[variant]]\ntitle = \"v\"\n[traces]", 55, "variant[1].name", "this key must be there", "add name"),
    campaign("[traces]", "[[variant]]\nname = \"v\"\n[[variant.derived]]\ntarget = \"rail_lag\"\nexpr = \"loop_delay\"\n[traces]", 59, "variant[1].derived[1].expr", "`rail_lag` does nothing here: the facility has no rail", "add a table [facility.rail]"),
    campaign("[traces]", "[compare]\ntrust = 0.1\n[traces]", 55, "compare", "there is nothing to compare", "add a [[variant]]"),
    campaign("[outer]\ndraws = 4", "[outer]\ndraws = 4\n[[outcome_map]]\ntitle = \"t\"\nx = \"loop_dely\"\ny = \"target_mass\"", 47, "outcome_map[1].x", "`loop_dely` is not dispersed", "did you mean `loop_delay`?"),
    campaign("[outer]\ndraws = 4", "[outer]\ndraws = 4\n[[outcome_map]]\ntitle = \"t\"\nx = \"loop_delay\"\ny = \"target_mass\"\nline = [{ name = \"l\", expr = \"loop_dely\" }]", 49, "outcome_map[1].line[1].expr", "no parameter `loop_dely`", "did you mean `loop_delay`?"),
    campaign("[traces]", compared!("along = \"loop_dely\""), 58, "compare.along", "`loop_dely` is not dispersed", "did you mean `loop_delay`?"),
    campaign("[traces]", compared!("along = \"loop_delay\"\nedges = [\"2 ms\", \"1 ms\"]"), 59, "compare.edges", "these are no ends of bands", "each above the one before"),
    campaign("[traces]", compared!("metrics = [\"created_enery\"]"), 58, "compare.metrics[1]", "no metric `created_enery`", "did you mean `injected_energy`?"),
    campaign("[traces]", compared!("map = [{ x = \"loop_delay\", y = \"contact_stiffness\", line = \"loop_dely\" }]"), 58, "compare.map[1].line", "no parameter `loop_dely`", "did you mean `loop_delay`?"),
    campaign("[[correlation]]", "[[dispersion]]\nvariable = \"loop_delay\"\ndist = { kind = \"uniform\", min = 1, max = 2 }\n[[correlation]]", 32, "dispersion[6].variable", "this name is taken", "write target ="),
    campaign("[[correlation]]", "[[dispersion]]\nvariable = \"mine\"\ndist = { kind = \"uniform\", min = 1, max = 2 }\n[[correlation]]", 33, "dispersion[6].dist", "`mine` does nothing here: no expression uses this variable", "use it in the expr"),
];

#[rustfmt::skip]
const SCENARIOS: &[Case] = &[
    scenario("scenario/2", "campaign/2", 1, "schema", "does not read this format", "schema = \"scenario/2\""),
    scenario("scenario/2", "scenario/1", 1, "schema", "does not read this format", "session_rules = \"none\""),
    scenario("\"0.25 ms\"", "\"0.3 ms\"", 7, "timing.tick", "not a whole number of substeps", "9e-4 s is the nearest"),
    scenario("time_limit = \"2 s\"\n", "", 5, "timing.time_limit", "must be there", "add time_limit = \"15 s\""),
    scenario("time_limit = \"2 s\"", "time_limit = \"2 kg\"", 8, "timing.time_limit", "this is a mass, not a time", "write \"2 s\""),
    scenario("mass = \"400 kg\"", "mass = \"-400 kg\"", 11, "base.mass", "-400 kg is out of range", "above 0 kg"),
    scenario("mass = \"400 kg\"", "mass = \"0 kg\"", 11, "base.mass", "0 kg is out of range", "above 0 kg"),
    scenario("mass = \"400 kg\"", "mass = 400", 11, "base.mass", "a mass needs its unit", "write \"400 kg\""),
    scenario("mass = \"400 kg\"", "mass = \"1e300 kg\"", 11, "base.mass", "out of range", "at most 1e7 kg"),
    scenario("izz = \"60 kg m^2\"", "izz = \"121 kg m^2\"", 12, "base.inertia", "triangle inequality", "about the centre of mass"),
    scenario("izz = \"60 kg m^2\"", "izz = \"60 kg m^2\", ixy = \"70 kg m^2\"", 12, "base.inertia", "not positive definite", "matrix elements"),
    scenario("\"arm.urdf\"", "\"no.urdf\"", 15, "arm.urdf", "there is no file", "relative to the file that names it"),
    scenario("\"30 deg\"]", "\"30 deg\", \"0 deg\"]", 16, "arm.angles", "3 values where 2 belong", "write 2 values in brackets"),
    scenario("\"30 deg\"]", "\"200 deg\"]", 16, "arm.angles[2]", "does not reach this angle", "from -171.887 deg to 171.887 deg"),
    scenario("\"joint_pd\"", "\"joint_p\"", 19, "arm.controller.law", "is not known", "did you mean `joint_pd`?"),
    scenario("\"joint_pd\"", "\"computed_torque\"", 20, "arm.controller.joint_stiffness", "does not take the key", "bandwidth, damping_ratio"),
    scenario("\"20 N m s/rad\"]", "\"9e4 N m s/rad\"]", 18, "arm.controller", "controller of joint 2: damping 9.0000e4", "write timing.tick ="),
    scenario("\"20 N m s/rad\"]", "\"20 N m s\"]", 21, "arm.controller.joint_damping[2]", "not a rotational damping", "write \"20 N m s/rad\""),
    scenario("link = \"tool\"", "link = \"upper\"", 16, "arm.angles", "the chain to part A has 1 joint: `shoulder`", "held: `elbow`"),
    scenario("link = \"tool\"", "link = \"root\"", 24, "part_a.link", "no joint of the arm moves link `root`", "name a link that a joint moves"),
    scenario("radius = \"20 mm\"", "radius = \"20 mmm\"", 27, "part_a.point[1].radius", "no unit `mmm`", "did you mean `mm`?"),
    scenario("shape = \"cone\"", "shape = \"sphere\"", 35, "part_b.solid[1].shape", "`sphere` needs the key `radius`", "`sphere` takes: radius"),
    scenario("shape = \"cone\"", "shape = \"plane\"", 36, "part_b.solid[1].mouth", "`plane` does not take the key `mouth`", "remove it"),
    scenario("bottom = \"30 mm\"", "bottom = \"200 mm\"", 37, "part_b.solid[1].bottom", "not narrower than the mouth", "a bottom below the mouth"),
    scenario("stiffness = \"5e4 N/m\"", "stiffness = \"5e10 N/m\"", 42, "contact.stiffness", "contact pair: stiffness 5.0000e10", "write timing.substep ="),
    scenario("damping = \"100 N s/m\"", "dissipation = \"1 s/m\"", 43, "contact.dissipation", "`linear` does not take", "damping, restitution"),
    scenario("friction = 0.2", "friction = -0.2", 44, "contact.friction", "-0.2 is out of range", "at least 0"),
    scenario("friction = 0.2", "friction = 0.2\nfricton = 1", 45, "contact.fricton", "no key `fricton`", "did you mean `friction`?"),
    scenario("angle = \"6 deg\"", "angle = \"6 m\"", 51, "latch.angle", "this is a length, not an angle", "write \"6 rad\""),
    scenario("gap = \"40 mm\"\n", "", 58, "start", "the start of the chaser is missing", "add gap = \"50 mm\""),
    scenario("gap = \"40 mm\"", "gap = \"-400 mm\"", 59, "start.gap", "`part_a.point[1]` overlaps `part_b.solid[1]` by", "then no parts overlap"),
    scenario("closing_speed = \"50 mm/s\"", "closing_speed = \"fast\"", 60, "start.closing_speed", "not a finite number", "write \"1.5 m/s\""),
    scenario("rotation_damping = \"100 N m s/rad\"", "rotation_damping = \"1e5 N m s/rad\"", 56, "latch.rotation_damping", "latch: damping 1.0000e5", "write timing.substep ="),
    scenario("[facility]", "[guidance.approach]\nspeed_gain = \"1e6 N s/m\"\nlateral_stiffness = \"1 N/m\"\nlateral_damping = \"1 N s/m\"\nattitude_stiffness = \"1 N m/rad\"\nattitude_damping = \"1 N m s/rad\"\nmax_force = \"10 N\"\nmax_torque = \"1 N m\"\n[facility]", 62, "guidance.approach", "closing speed: damping 1.0000e6", "write timing.tick ="),
    scenario("loop_delay = \"4 ms\"", "loop_delay = \"1.2 ms\"", 63, "facility.loop_delay", "less than the loop has by itself", "at least \"1.375000 ms\""),
    scenario("loop_delay = \"4 ms\"", "loop_delay = \"130 ms\"", 63, "facility.loop_delay", "0.13 s is out of range", "at most 0.128 s"),
    scenario("\"1 %\"", "\"120 %\"", 64, "facility.drop_probability", "1.2 is out of range", "at least 0, at most 1"),
    scenario("lag = \"20 ms\"", "lag = \"0.3 ms\"", 65, "facility.robot1.lag", "too short for a substep", "a lag of at least 0.5000 ms"),
    scenario("period = \"1 ms\"", "period = \"1.1 ms\"", 66, "facility.sensor.period", "not a whole number of substeps", "0.001 s is the nearest"),
    scenario("period = \"1 ms\" }", "period = \"1 ms\", crosstalk = 0.01, crosstalk_pattern = [[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0]] }", 66, "facility.sensor.crosstalk", "this does nothing: every element of the crosstalk pattern is 0", "an element that is not 0"),
    scenario("session_rules = \"none\"\n", "", 62, "facility", "the rules that end and stop a session", "add file ="),
    scenario("\"none\"", "\"some\"", 67, "facility.session_rules", "`some` is not known here", "none"),
    scenario("session_rules = \"none\"\n", "session_rules = \"none\"\nfile = \"none.toml\"\n", 67, "facility.session_rules", "written twice", "remove one"),
    scenario("unstable_speed = \"2 m/s\"\n", "", 62, "facility", "the divergence limit of the HIL loop is missing", "add unstable_speed"),
    scenario("touch = true\n", "", 70, "task.touch", "must be there", "touch = true"),
    scenario("max_contact_force", "max_force", 73, "task.max_force", "no key `max_force`", "max_contact_force (latch excluded)"),
    scenario("max_depth = \"50 mm\"\n", "", 70, "task.max_depth", "must be there", "add max_depth = \"20 mm\""),
];

#[rustfmt::skip]
const MODELS: &[Case] = &[
    arm("<mass value=\"20\"/>", "<mass value=\"-20\"/>", 13, "link[upper].mass", "link `upper` has the mass -20 kg", "a mass above 0 kg"),
    arm("iyy=\"2\"", "iyy=\"0.1\"", 14, "link[upper].inertia", "link `upper` has an inertia that no rigid body has", "the greatest is at most their sum"),
    arm("ixx=\"0.5\"", "ixx=\"NaN\"", 14, "link[upper].inertia", "not finite", "about the centre of mass"),
    arm("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>", 7, "joint[shoulder].axis", "no place or direction", "an axis that is not zero"),
    arm("name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"floating\"", 17, "joint[elbow]", "neither revolute, continuous, prismatic nor fixed", "make it revolute, prismatic or fixed"),
    arm("<child link=\"fore\"/>", "<child link=\"four\"/>", 17, "joint[elbow]", "which does not exist", "correct the name"),
    arm("<parent link=\"fore\"/>", "<parent link=\"tool\"/>", 36, "link[tool]", "not connected to the root", "join it to the chain"),
    arm("</robot>\n", "", 36, "robot", "not a URDF", "every element is closed"),
    table("run,delay_ms", "run,delay", 1, "no column `delay_ms`", "did you mean `delay`?"),
    table("2,8.5", "2,slow", 3, "`slow` is not a finite number", "write a finite number in every row"),
    table("2,8.5", "2,850", 3, "0.85 s is out of range", "at most 0.128 s"),
];

/// Changes of the scenario after which a dispersion of the valid campaign, or an added one, has no effect.
#[rustfmt::skip]
const IDLE: &[(&str, &str, &str, &str, &str, &str)] = &[
    // In the scenario: old and new; in the campaign: the target and its bounds; then message and remedy.
    (LATCH, "", "latch_damping", "min = \"100 N s/m\", max = \"500 N s/m\"", "`latch_damping` does nothing here: the scenario has no latch", "remove it, or add a table [latch] to the scenario"),
    (LATCH, "", "latch_rotation_stiffness", "min = \"100 N m/rad\", max = \"500 N m/rad\"", "the scenario has no latch", "add a table [latch]"),
    ("law = \"linear\"\nstiffness = \"5e4 N/m\"\ndamping = \"100 N s/m\"", "law = \"power\"\nstiffness = \"5e4 N/m\"\ndissipation = \"0.1 s/m\"", "contact_damping", "min = \"10 N s/m\", max = \"100 N s/m\"", "`contact_damping` does nothing here: the contact law has a dissipation and no damping", "disperse `contact_dissipation` instead, or write law = \"linear\" in the scenario"),
    ("damping = \"100 N s/m\"\n", "", "contact_damping_error", "min = -0.1, max = 0.1", "`contact_damping_error` does nothing here: the contact has neither damping nor dissipation", "give the contact a damping above 0"),
    ("[task]", "[task] # as it was", "compensator_delay", "min = \"2 ms\", max = \"3 ms\"", "`compensator_delay` does nothing here: the facility has no compensator", "add a table [facility.compensator]"),
    ("[task]", "[facility.compensator]\nkind = \"smith\"\ndelay = \"4 ms\"\nstiffness = \"5e4 N/m\"\n[task]", "compensator_margin", "min = 0.1, max = 0.5", "`compensator_margin` does nothing here: the facility's kind of compensator does not take it", "choose a kind that takes it"),
    ("[task]", "[facility.compensator]\nkind = \"virtual_damping\"\ndelay = \"0 ms\"\nstiffness = \"5e4 N/m\"\n[task]", "compensator_margin", "min = 0.1, max = 0.5", "always 0 the compensator damps nothing", "give the compensator a delay"),
    ("[task]", "[task] # as it was", "tare_error_force_x", "min = \"0.1 N\", max = \"0.3 N\"", "`tare_error_force_x` does nothing here: the sensor is not tared", "write tared = true"),
    ("[task]", "[task] # as it was", "load_mass_error", "min = -0.1, max = 0.1", "`load_mass_error` does nothing here: no load is mounted on the sensor", "add a table [facility.sensor.load]"),
    ("[task]", "[facility.rail]\naxis = [1, 0, 0]\nshare = 0\n[task]", "rail_lag", "min = \"2 ms\", max = \"3 ms\"", "`rail_lag` does nothing here: the rail's share of the motion is 0", "raise facility.rail.share"),
    ("[task]", "[facility.rail]\naxis = [1, 0, 0]\nshare = 0.5\n[task]", "rail_lag_damping", "min = 0.5, max = 1", "the lag of this response is always 0", "give the response a lag above 0 s"),
    ("period = \"1 ms\" }", "period = \"1 ms\", crosstalk_pattern = [[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0]] }", "sensor_crosstalk", "min = 0, max = 0.01", "every element of the crosstalk pattern is 0", "write facility.sensor.crosstalk_pattern with an element that is not 0"),
];

/// The latch of the valid scenario, and the keys that require it.
const LATCH: &str = "[latch]\npoint = [\"0 m\", \"0 m\", \"0 m\"]\nseat = [\"220 mm\", \"0 m\", \"0 m\"]\ndepth = \"10 mm\"\noffset = \"20 mm\"\nangle = \"6 deg\"\nspeed = \"0.1 m/s\"\nstiffness = \"2e4 N/m\"\ndamping = \"500 N s/m\"\nrotation_stiffness = \"2000 N m/rad\"\nrotation_damping = \"100 N m s/rad\"\n";

#[test]
fn dispersions_without_effect_are_rejected() {
    for (old, new, target, bounds, message, remedy) in IDLE {
        let (line, key, printed, help) = refused(|folder| {
            let text = fs::read_to_string(folder.join(SCENARIO)).expect("read");
            assert!(text.contains(old), "{old}");
            let text = text.replacen(old, new, 1);
            let text = if *old == LATCH { text.replace("capture = true\n", "capture = false\n") } else { text };
            fs::write(folder.join(SCENARIO), text).expect("written");
            let text = fs::read_to_string(folder.join(CAMPAIGN)).expect("read");
            let added = format!(
                "[[dispersion]]\ntarget = \"{target}\"\ndist = {{ kind = \"uniform\", {bounds} }}\n\n[[correlation]]"
            );
            fs::write(folder.join(CAMPAIGN), text.replacen("[[correlation]]", &added, 1)).expect("written");
        });
        assert!(printed.contains(message) && help.contains(remedy), "{target}: {printed}: {help}");
        assert_eq!((line, key.as_str()), (33, "dispersion[6].dist"), "{target}");
    }
}

/// A parameter without direct effect is legal if a derived value depends on it.
#[test]
fn parameter_without_effect_may_define_a_derived_one() {
    let folder = folder();
    let text = fs::read_to_string(folder.path().join(CAMPAIGN)).expect("read");
    let carrier = "[[dispersion]]\ntarget = \"rail_lag\"\ndist = { kind = \"uniform\", min = \"5 ms\", max = \"9 ms\" }\n\n[[derived]]\ntarget = \"robot2_lag\"\nexpr = \"rail_lag\"\n\n[[correlation]]";
    fs::write(folder.path().join(CAMPAIGN), text.replacen("[[correlation]]", carrier, 1)).expect("written");
    let campaign = softdock_campaign::load(&folder.path().join(CAMPAIGN));
    assert!(campaign.is_ok(), "{}", campaign.expect_err("problems"));
}

/// The valid files: `data/bad` of this repository, found from whichever package runs this.
fn valid() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = here.ancestors().map(|folder| folder.join("tests/data/bad")).find(|folder| folder.is_dir());
    folder.expect("the repository holds tests/data/bad")
}

/// Returns a folder with the valid files, of which one may be damaged.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in [CAMPAIGN, SCENARIO, ARM, TABLE, COVARIANCE] {
        fs::copy(valid().join(file), folder.path().join(file)).expect("copied");
    }
    folder
}

/// Returns the mismatch of the first problem of a case, if any.
fn missed(case: &Case) -> Option<String> {
    let folder = folder();
    let path = folder.path().join(case.file);
    let text = fs::read_to_string(&path).expect("read");
    assert!(text.contains(case.old), "{}: the valid file has no `{}`", case.file, case.old);
    fs::write(&path, text.replacen(case.old, case.new, 1)).expect("written");
    let Err(problems) = softdock_campaign::load(&folder.path().join(CAMPAIGN)) else {
        return Some(format!("`{}` is not refused", case.new));
    };
    let first = problems.iter().next().expect("at least one problem");
    let file = first.file.file_name().and_then(|name| name.to_str()).unwrap_or("");
    let exact = (file, first.line, first.key.as_str()) == case.place;
    let matches = first.message.contains(case.message) && first.remedy.contains(case.remedy);
    (!exact || !matches).then(|| {
        format!(
            "`{}` should give {:?}, `{}`, `{}`, but gives\n{problems}",
            case.new, case.place, case.message, case.remedy
        )
    })
}

/// Checks all cases, so that one run shows every mismatch.
fn check(cases: &[Case]) {
    let missed: Vec<String> = cases.iter().filter_map(missed).collect();
    assert!(missed.is_empty(), "{} of {} cases:\n{}", missed.len(), cases.len(), missed.join("\n\n"));
}

#[test]
fn undamaged_files_are_valid() {
    let campaign = softdock_campaign::load(&folder().path().join(CAMPAIGN));
    assert!(campaign.is_ok(), "{}", campaign.expect_err("problems"));
}

#[test]
fn damaged_campaigns_are_rejected() {
    check(CAMPAIGNS);
}

#[test]
fn damaged_variants_are_rejected() {
    check(VARIANTS);
}

#[test]
fn damaged_scenarios_are_rejected() {
    check(SCENARIOS);
}

#[test]
fn damaged_models_and_tables_are_rejected() {
    check(MODELS);
}

/// Loads the valid folder after `spoil` and returns the first problem's line, key, message and remedy.
fn refused(spoil: impl Fn(&Path)) -> (usize, String, String, String) {
    let folder = folder();
    spoil(folder.path());
    let problems = softdock_campaign::load(&folder.path().join(CAMPAIGN)).expect_err("spoiled");
    let first = problems.iter().next().expect("at least one problem");
    (first.line, first.key.clone(), first.message.clone(), first.remedy.clone())
}

#[test]
fn binary_files_are_rejected() {
    let (line, _, message, remedy) = refused(|folder| {
        let mut bytes = fs::read(folder.join(CAMPAIGN)).expect("read");
        let place = bytes.windows(5).position(|word| word == b"valid").expect("a word to spoil");
        bytes[place] = 0xE9;
        fs::write(folder.join(CAMPAIGN), bytes).expect("written");
    });
    assert_eq!(line, 2);
    assert!(message.contains("byte 0xE9 is not UTF-8") && remedy.contains("encoding UTF-8"), "{message}: {remedy}");

    let (line, _, message, remedy) = refused(|folder| fs::write(folder.join(CAMPAIGN), "").expect("written"));
    assert!(line == 1 && message.contains("empty") && remedy.contains("campaign/2"), "{message}: {remedy}");

    let (_, key, message, _) = refused(|folder| fs::write(folder.join(ARM), "").expect("written"));
    assert!(key == "robot" && message.contains("not a URDF"), "{message}");

    let (_, _, message, remedy) = refused(|folder| {
        fs::remove_file(folder.join(CAMPAIGN)).expect("removed");
        fs::create_dir(folder.join(CAMPAIGN)).expect("made");
    });
    assert!(message.contains("is a directory") && remedy.contains("name a file"), "{message}: {remedy}");

    let (_, _, message, remedy) = refused(|folder| fs::remove_file(folder.join(CAMPAIGN)).expect("removed"));
    assert!(message.contains("there is no file") && remedy.contains("check the path"), "{message}: {remedy}");
}

#[test]
fn several_problems_are_reported_at_once() {
    let folder = folder();
    let path = folder.path().join(CAMPAIGN);
    let text = fs::read_to_string(&path).expect("read");
    let spoiled = text.replace("runs = 100", "runs = 0").replace("\"99 %\"", "2").replace("\"80 N\"", "80");
    fs::write(&path, spoiled).expect("written");
    let problems = softdock_campaign::load(&path).expect_err("spoiled");
    assert_eq!(problems.iter().map(|problem| problem.line).collect::<Vec<_>>(), [5, 44, 51, 52]);
}

/// Every file truncated anywhere, or with any character changed, gives problems or, by chance, a campaign, but no
/// panic.
#[test]
fn damaged_files_never_panic() {
    for file in [CAMPAIGN, SCENARIO, ARM, TABLE] {
        let folder = folder();
        let path = folder.path().join(file);
        let bytes = fs::read(&path).expect("read");
        let damaged = (0..bytes.len()).step_by(5).flat_map(|place| {
            let mut changed = bytes.clone();
            changed[place] = b"9-\"[{=.e\n"[place % 9];
            [bytes[..place].to_vec(), changed]
        });
        for text in damaged {
            fs::write(&path, &text).expect("written");
            if let Err(problems) = softdock_campaign::load(&folder.path().join(CAMPAIGN)) {
                let remedied = problems.iter().all(|problem| !problem.remedy.is_empty());
                assert!(remedied, "{problems} in\n{}", String::from_utf8_lossy(&text));
            }
        }
    }
}
