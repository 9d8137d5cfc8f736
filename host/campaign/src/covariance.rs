//! Covariance matrices from CSV files: their standard deviations and the factor of their correlations.

use crate::problem::{Problem, Problems};
use crate::source::Source;
use nalgebra::DMatrix;

/// Greatest asymmetry, as a share of the product of both standard deviations: a file may be rounded to seven digits.
const ASYMMETRY: f64 = 1e-6;

/// Standard deviations in SI and the lower triangular factor of the correlation matrix, row by row.
///
/// A row for each target; a header, if there is one, has the targets in their order. `scales` is the SI value of one unit
/// of each target in the file.
pub(crate) fn read(source: &Source, targets: &[&str], scales: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), Problems> {
    let count = targets.len();
    let refuse = |line: &str, value: &str, message: String, remedy: String| -> Problems {
        let start = line.as_ptr() as usize - source.text().as_ptr() as usize;
        Problem::at(source, start..start + line.len(), message).key("covariance").value(value).remedy(remedy).into()
    };
    let mut lines: Vec<&str> = source.text().lines().filter(|line| !line.trim().is_empty()).collect();
    let cells = |line: &'_ str| -> Vec<String> {
        line.split(',').map(|cell| cell.trim().trim_matches('"').trim().to_owned()).collect()
    };
    if let Some(header) =
        lines.first().copied().filter(|line| cells(line).iter().all(|cell| cell.parse::<f64>().is_err()))
    {
        if cells(header) != targets {
            let remedy = format!("write {}, or remove the header", targets.join(","));
            return Err(refuse(
                header,
                header,
                "the header is not that of the targets in their order".to_owned(),
                remedy,
            ));
        }
        lines.remove(0);
    }
    let shape = format!("write {count} rows of {count} numbers, one for each of {}", targets.join(", "));
    if lines.len() != count {
        let last = lines.last().copied().unwrap_or(source.text());
        return Err(refuse(last, last, format!("{} rows for {count} targets", lines.len()), shape));
    }
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (line, target) in lines.iter().zip(targets) {
        let cells = cells(line);
        if cells.len() != count {
            return Err(refuse(line, line, format!("{} numbers for {count} targets", cells.len()), shape));
        }
        let mut row = Vec::new();
        for (cell, other) in cells.iter().zip(targets) {
            let Some(number) = cell.parse::<f64>().ok().filter(|number| number.is_finite()) else {
                let message = format!("`{cell}` (of `{target}` with `{other}`) is not a finite number");
                return Err(refuse(line, cell, message, "write a finite number".to_owned()));
            };
            row.push(number);
        }
        rows.push(row);
    }
    for (place, target) in targets.iter().enumerate() {
        let variance = rows[place][place];
        if variance <= 0.0 {
            let message = format!("the variance {variance} of `{target}` is not above 0");
            let remedy = "write a variance above 0; disperse a parameter that does not vary as a constant".to_owned();
            return Err(refuse(lines[place], &variance.to_string(), message, remedy));
        }
    }
    let sigmas: Vec<f64> = (0..count).map(|place| rows[place][place].sqrt()).collect();
    for i in 0..count {
        for j in 0..i {
            let (lower, upper) = (rows[i][j], rows[j][i]);
            if (lower - upper).abs() > ASYMMETRY * sigmas[i] * sigmas[j] {
                let message = format!(
                    "the matrix is not symmetric: {lower} for `{}` with `{}`, {upper} in row {} the other way round",
                    targets[i],
                    targets[j],
                    j + 1
                );
                return Err(refuse(
                    lines[i],
                    &lower.to_string(),
                    message,
                    "write the same number in both places".to_owned(),
                ));
            }
        }
    }
    let correlation = |i: usize, j: usize| match i == j {
        true => 1.0,
        false => 0.5 * (rows[i][j] + rows[j][i]) / (sigmas[i] * sigmas[j]),
    };
    for i in 0..count {
        if let Some(j) = (0..i).find(|j| correlation(i, *j).abs() >= 1.0) {
            let message = format!(
                "the covariance {} of `{}` and `{}` is not below the product of their standard deviations ({:.6e})",
                rows[i][j],
                targets[i],
                targets[j],
                sigmas[i] * sigmas[j]
            );
            let remedy = "lower it: the matrix must be positive definite".to_owned();
            return Err(refuse(lines[i], &rows[i][j].to_string(), message, remedy));
        }
    }
    let matrix = DMatrix::from_fn(count, count, correlation);
    let Some(factor) = lower_factor(matrix.clone()) else {
        let least = matrix.symmetric_eigenvalues().min();
        let message = format!("the matrix is not positive definite: least eigenvalue of its correlations {least:.3e}");
        let remedy = "weaken the correlations: no set of variables has all of these at once".to_owned();
        return Err(refuse(lines[0], lines[0], message, remedy));
    };
    Ok((sigmas.iter().zip(scales).map(|(sigma, scale)| sigma * scale).collect(), factor))
}

/// The lower triangular factor of a correlation matrix, row by row; `None` if the matrix is not positive definite.
pub(crate) fn lower_factor(matrix: DMatrix<f64>) -> Option<Vec<Vec<f64>>> {
    let count = matrix.nrows();
    // A pivot of rounding errors alone is a singular matrix.
    let cholesky = matrix.cholesky().filter(|cholesky| cholesky.l_dirty().diagonal().min() > 1e-6)?;
    let lower = cholesky.l();
    Some((0..count).map(|i| lower.row(i).iter().take(i + 1).copied().collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<(Vec<f64>, Vec<Vec<f64>>), Problems> {
        read(&Source::new("covariance.csv".into(), text.to_owned()), &["x", "y"], &[1e-3, 1.0])
    }

    #[test]
    fn deviations_and_correlations_follow() {
        for text in ["4,3\n3,9\n", "x, y\n4, 3\n\n3, 9\n", "\"x\",\"y\"\n4,3\n3,9"] {
            let (sigmas, factor) = of(text).expect("a covariance matrix");
            assert_eq!(sigmas, [2e-3, 3.0]);
            assert!((factor[1][0] - 0.5).abs() < 1e-15 && (factor[1][1] - 0.75_f64.sqrt()).abs() < 1e-15, "{factor:?}");
        }
    }

    #[test]
    fn errors_have_their_line() {
        let cases = [
            ("y,x\n4,3\n3,9\n", 1, "not that of the targets"),
            ("4,3\n", 1, "1 rows for 2 targets"),
            ("", 1, "0 rows for 2 targets"),
            ("4,3\n3,9,1\n", 2, "3 numbers for 2 targets"),
            ("4,3\n3,nan\n", 2, "`nan` (of `y` with `y`)"),
            ("4,3\n3,x\n", 2, "`x` (of `y` with `y`)"),
            ("4,3\n3,0\n", 2, "variance 0 of `y`"),
            ("x,y\n4,3\n2,9\n", 3, "not symmetric: 2 for `y` with `x`, 3 in row 1"),
            ("4,6\n6,9\n", 2, "not below the product"),
            ("4,5.9999999999999\n5.9999999999999,9\n", 1, "not positive definite"),
        ];
        for (text, line, message) in cases {
            let problems = of(text).expect_err(text);
            let problem = problems.iter().next().expect("never empty");
            assert_eq!(problem.line, line, "{text}: {problem}");
            assert!(problem.to_string().contains(message) && !problem.remedy.is_empty(), "{text}: {problem}");
        }
    }
}
