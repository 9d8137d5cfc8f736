//! The campaign file as written.

use super::compare::{CompareTable, VariantTable};
use super::{At, Quantities, Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

/// A dispersion campaign: what varies, how often it is run, and what must hold.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "softdock campaign")]
pub(crate) struct CampaignFile {
    /// Format and version of this file: "campaign/2".
    pub(crate) schema: At<String>,
    /// Name of the campaign and of its results folder: letters, digits, - and _.
    pub(crate) id: At<String>,
    /// One line for people.
    pub(crate) title: At<String>,
    /// Seed of all random numbers, required: there is no silent entropy.
    pub(crate) seed: At<u64>,
    /// Number of runs.
    pub(crate) runs: At<u64>,
    /// Scenario file, relative to this file.
    pub(crate) scenario: At<String>,
    /// How the runs are executed.
    #[serde(default)]
    pub(crate) execution: ExecutionTable,
    /// How the samples are drawn.
    #[serde(default)]
    pub(crate) sampling: SamplingTable,
    /// What varies from run to run.
    #[serde(default)]
    pub(crate) dispersion: Vec<DispersionTable>,
    /// Rank correlations between dispersions.
    #[serde(default)]
    pub(crate) correlation: Vec<CorrelationTable>,
    /// Parameters that follow from others.
    #[serde(default)]
    pub(crate) derived: Vec<DerivedTable>,
    /// Outer draws of what is fixed but unknown; only with epistemic dispersions.
    pub(crate) outer: Option<At<OuterTable>>,
    /// Custom metrics, for its requirements.
    #[serde(default)]
    pub(crate) metric: Vec<MetricTable>,
    /// What must hold, how often, and how sure.
    #[serde(default)]
    pub(crate) requirement: Vec<RequirementTable>,
    /// Facilities on which the same draws are run, side by side; without any, the scenario's alone.
    #[serde(default)]
    pub(crate) variant: Vec<VariantTable>,
    /// How the variants are compared.
    pub(crate) compare: Option<At<CompareTable>>,
    /// Maps of the runs' outcomes, for the report.
    #[serde(default)]
    pub(crate) outcome_map: Vec<OutcomeMapTable>,
    /// Time histories to keep.
    #[serde(default)]
    pub(crate) traces: TracesTable,
    /// Contact events to keep, one row each; without it none.
    pub(crate) contact_events: Option<ContactEventsTable>,
}

/// A map over two dispersed parameters: a dot for each run, coloured by its outcome and cause.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OutcomeMapTable {
    /// What the map shows.
    pub(crate) title: At<String>,
    /// Dispersed or derived parameter along the horizontal axis.
    pub(crate) x: At<String>,
    /// Dispersed or derived parameter along the vertical axis.
    pub(crate) y: At<String>,
    /// Lines over the dots, a closed form for example.
    #[serde(default)]
    pub(crate) line: Vec<MapLineTable>,
}

/// A line over a map of outcomes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MapLineTable {
    /// What the line is.
    pub(crate) name: At<String>,
    /// The value of y in SI units, as an expression of parameters; parameters that are not on the horizontal axis have their
    /// undispersed values.
    pub(crate) expr: At<String>,
}

/// How the runs are executed.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExecutionTable {
    /// "auto" (a GPU if there is one), "gpu" or "cpu".
    pub(crate) backend: Option<At<String>>,
    /// Share of the runs that is repeated in f64 and compared.
    pub(crate) parity: Option<Quantity>,
    /// Share of the runs that is repeated in f64 at half the substep; default the parity share, 200 runs at most.
    pub(crate) half_step: Option<Quantity>,
    /// Runs in a shard, the unit of resuming and of cluster work.
    pub(crate) shard_runs: Option<At<u64>>,
    /// What an invalid run counts as: "count-as-failure" or "report-only".
    pub(crate) invalid: Option<At<String>>,
}

/// How the samples are drawn.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SamplingTable {
    /// "random"; for exploring only, without verdicts: "sobol" (at most 65536 runs) or "lhs" (Latin hypercube).
    pub(crate) method: Option<At<String>>,
}

/// One dispersed parameter, or several drawn together.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DispersionTable {
    /// A parameter (`target_mass`), a whole vector (`offset`) with kind mvnormal, or a number that the scenario file writes, by
    /// its path (`scenario.contact.pair[1].stiffness`).
    pub(crate) target: Option<At<String>>,
    /// Instead of a target: a pure number of the campaign's own, by its name, for the expressions of `[[derived]]`.
    pub(crate) variable: Option<At<String>>,
    /// Several parameters, with kind mvnormal.
    pub(crate) targets: Option<At<Vec<At<String>>>>,
    /// Its distribution.
    pub(crate) dist: At<DistributionTable>,
    /// "aleatory" (varies from run to run) or "epistemic" (fixed but unknown, drawn in the outer loop).
    pub(crate) class: Option<At<String>>,
    /// Where the figures come from; printed in the report.
    pub(crate) source: Option<At<String>>,
}

/// A distribution; which keys it takes depends on its kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DistributionTable {
    /// "constant", "normal", "uniform", "truncnormal", "loguniform", "triangular", "beta", "weibull", "arcsine", "discrete",
    /// "mvnormal" or "table".
    pub(crate) kind: At<String>,
    /// constant: the value.
    pub(crate) value: Option<Quantity>,
    /// discrete: the values, no two equal.
    pub(crate) values: Option<Quantities>,
    /// discrete: weight of each value, above 0, of any sum; without it all values are equally likely.
    pub(crate) weights: Option<Quantities>,
    /// normal, truncnormal: the mean; mvnormal: a list of means.
    pub(crate) mean: Option<At<OneOrMore>>,
    /// normal, truncnormal: the standard deviation; mvnormal: a list of them, without `covariance`.
    pub(crate) sigma: Option<At<OneOrMore>>,
    /// uniform, truncnormal, loguniform, triangular, beta, arcsine: lower bound; weibull: lower bound, default 0.
    pub(crate) min: Option<Quantity>,
    /// uniform, truncnormal, loguniform, triangular, beta, arcsine: upper bound.
    pub(crate) max: Option<Quantity>,
    /// triangular: the most probable value, from min to max.
    pub(crate) mode: Option<Quantity>,
    /// beta: shape at the lower bound; above 1 the density is 0 there, below 1 infinite.
    pub(crate) a: Option<Quantity>,
    /// beta: shape at the upper bound.
    pub(crate) b: Option<Quantity>,
    /// weibull: distance from min that 63.2 % of the draws do not exceed.
    pub(crate) scale: Option<Quantity>,
    /// weibull: its shape; 1 is the exponential distribution, 2 the Rayleigh distribution.
    pub(crate) shape: Option<Quantity>,
    /// mvnormal: correlation matrix; without it the components are independent.
    pub(crate) corr: Option<At<Vec<Vec<f64>>>>,
    /// mvnormal, instead of sigma and corr: CSV file of the covariance matrix, relative to this file; a row for each target,
    /// an optional header of the targets in their order.
    pub(crate) covariance: Option<At<String>>,
    /// table: CSV file with a header, relative to this file.
    pub(crate) file: Option<At<String>>,
    /// table: name of the column.
    pub(crate) column: Option<At<String>>,
    /// table: unit of the column ("1" for pure numbers); mvnormal with covariance: unit of every target in that file, SI
    /// without it.
    pub(crate) unit: Option<At<String>>,
}

/// One quantity or a list of them.
#[derive(Clone, Debug)]
pub(crate) enum OneOrMore {
    One(Scalar),
    More(Vec<Quantity>),
}

impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> serde::de::Visitor<'de> for Either {
            type Value = OneOrMore;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number with its unit, or a list of them")
            }
            fn visit_i64<E>(self, value: i64) -> Result<OneOrMore, E> {
                Ok(OneOrMore::One(Scalar::Number(value as f64)))
            }
            fn visit_f64<E>(self, value: f64) -> Result<OneOrMore, E> {
                Ok(OneOrMore::One(Scalar::Number(value)))
            }
            fn visit_str<E>(self, value: &str) -> Result<OneOrMore, E> {
                Ok(OneOrMore::One(Scalar::Text(value.to_owned())))
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut list: A) -> Result<OneOrMore, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = list.next_element::<Quantity>()? {
                    items.push(item);
                }
                Ok(OneOrMore::More(items))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl JsonSchema for OneOrMore {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "QuantityOrList".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let one = generator.subschema_for::<Scalar>();
        schemars::json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
    }
}

/// A group of dispersions with rank correlation (Gaussian copula).
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CorrelationTable {
    /// Dispersed parameters.
    pub(crate) targets: At<Vec<At<String>>>,
    /// Spearman rank correlations: symmetric, ones on the diagonal.
    pub(crate) matrix: At<Vec<Vec<f64>>>,
}

/// A parameter computed from others.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DerivedTable {
    /// The parameter.
    pub(crate) target: At<String>,
    /// Its value in SI units: + - * / ^ ( ), min max sqrt abs sin cos exp log, numbers, parameter names.
    pub(crate) expr: At<String>,
}

/// The loop around the runs for what is fixed but unknown.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OuterTable {
    /// Number of outer draws; each gets runs / draws of the runs.
    pub(crate) draws: At<u64>,
}

/// A custom metric.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MetricTable {
    /// Its name: lower-case letters, digits and _.
    pub(crate) name: At<String>,
    /// Its SI unit, against which the expression is checked.
    pub(crate) unit: At<String>,
    /// Its value in SI units: + - * / ^ ( ), min max sqrt abs sin cos exp log, numbers, names of metrics and parameters.
    pub(crate) expr: At<String>,
    /// What it is, for reports.
    pub(crate) text: Option<At<String>>,
}

/// One requirement to be signed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RequirementTable {
    /// Id as in the requirements document.
    pub(crate) id: At<String>,
    /// Its text.
    pub(crate) text: At<String>,
    /// What is judged: "space", "facility" (an aborted session is a failure) or "agreement" of the facility with space.
    pub(crate) subject: At<String>,
    /// Metric of the run that is judged; of the agreement: "false_pass_rate", "false_fail_rate" or "abort_rate".
    pub(crate) metric: At<String>,
    /// Passes at or below this.
    pub(crate) at_most: Option<Quantity>,
    /// Passes at or above this; with at_most both must hold.
    pub(crate) at_least: Option<Quantity>,
    /// Share of cases that must pass; not for the agreement.
    pub(crate) probability: Option<Quantity>,
    /// Confidence of the demonstration.
    pub(crate) confidence: Quantity,
}

/// Time histories to keep.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TracesTable {
    /// Samples per second; without it every tick.
    pub(crate) rate: Option<Quantity>,
    /// "nominal", "failed", "invalid", "worst:N", "random:N".
    pub(crate) keep: Option<At<Vec<At<String>>>>,
}

/// Contact events to keep.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ContactEventsTable {
    /// Of which runs: "nominal", "failed", "invalid", "worst:N", "random:N"; "all" makes every run once more in f64.
    pub(crate) keep: At<Vec<At<String>>>,
    /// Separations of at most this time do not end an event; default "0 s".
    pub(crate) merge_gap: Option<Quantity>,
}
