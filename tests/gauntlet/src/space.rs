//! Vectors, rotations and inertias in three dimensions, as far as the rigs need them.

/// Vector in the frame given by its name.
pub(crate) type Vector = [f64; 3];
/// A unit quaternion (w, x, y, z) that turns body axes into world axes.
pub(crate) type Quaternion = [f64; 4];
/// A symmetric or general matrix by rows.
pub(crate) type Matrix = [Vector; 3];

pub(crate) fn sum(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

pub(crate) fn difference(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(crate) fn scaled(factor: f64, a: Vector) -> Vector {
    a.map(|x| factor * x)
}

pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn times(m: &Matrix, a: Vector) -> Vector {
    m.map(|row| dot(row, a))
}

/// Inverse of a regular matrix.
pub(crate) fn inverse(m: &Matrix) -> Matrix {
    let columns = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant = dot(m[0], columns[0]);
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i] / determinant))
}

/// Inertia of a point mass \[kg\] at a place \[m\] about the origin \[kg m^2\].
pub(crate) fn point_inertia(mass: f64, place: Vector) -> Matrix {
    let square = dot(place, place);
    std::array::from_fn(|i| std::array::from_fn(|j| mass * (if i == j { square } else { 0.0 } - place[i] * place[j])))
}

/// Acceleration of a point of a turning body relative to its origin's: a x r + w x (w x r).
pub(crate) fn carried(rate: Vector, acceleration: Vector, place: Vector) -> Vector {
    sum(cross(acceleration, place), cross(rate, cross(rate, place)))
}

/// A world vector in body axes.
pub(crate) fn into_body([w, x, y, z]: Quaternion, a: Vector) -> Vector {
    into_world([w, -x, -y, -z], a)
}

/// A body vector in world axes.
pub(crate) fn into_world([w, x, y, z]: Quaternion, a: Vector) -> Vector {
    let axis = [x, y, z];
    let turn = scaled(2.0, cross(axis, a));
    sum(sum(a, scaled(w, turn)), cross(axis, turn))
}

/// Rate of the quaternion of a body that turns at a rate in body axes \[rad/s\].
pub(crate) fn quaternion_rate([w, x, y, z]: Quaternion, [p, q, r]: Vector) -> Quaternion {
    [
        0.5 * (-x * p - y * q - z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
    ]
}

/// An attitude after a further turn in world axes \[rad\].
pub(crate) fn turned([w, i, j, k]: Quaternion, turn: Vector) -> Quaternion {
    let angle = dot(turn, turn).sqrt();
    let share = if angle > 1e-12 { (0.5 * angle).sin() / angle } else { 0.5 };
    let (a, [x, y, z]) = ((0.5 * angle).cos(), scaled(share, turn));
    [
        a * w - x * i - y * j - z * k,
        a * i + x * w + y * k - z * j,
        a * j - x * k + y * w + z * i,
        a * k + x * j - y * i + z * w,
    ]
}

/// The turn from one attitude to another in world axes \[rad\], the shorter way round.
pub(crate) fn turn_between([w, x, y, z]: Quaternion, [a, i, j, k]: Quaternion) -> Vector {
    let cosine = a * w + i * x + j * y + k * z;
    let way = [i * w - a * x - (j * z - k * y), j * w - a * y - (k * x - i * z), k * w - a * z - (i * y - j * x)];
    let sine = dot(way, way).sqrt();
    let angle = 2.0 * sine.atan2(cosine.abs());
    scaled(if sine > 1e-12 { angle / sine } else { 2.0 } * cosine.signum(), way)
}

/// Quaternion of roll, pitch and yaw \[rad\]: about x, then y, then z of the world.
pub(crate) fn from_angles([roll, pitch, yaw]: Vector) -> Quaternion {
    let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(|angle| (0.5 * angle).sin_cos());
    [cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]
}

/// Rate in body axes \[rad/s\] from roll, pitch and yaw \[rad\] and their rates \[rad/s\].
pub(crate) fn body_rate([roll, pitch, _]: Vector, [roll_rate, pitch_rate, yaw_rate]: Vector) -> Vector {
    let ((sr, cr), (sp, cp)) = (roll.sin_cos(), pitch.sin_cos());
    [roll_rate - yaw_rate * sp, pitch_rate * cr + yaw_rate * cp * sr, yaw_rate * cp * cr - pitch_rate * sr]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: &[f64], b: &[f64], bound: f64) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < bound), "{a:?} {b:?}");
    }

    #[test]
    fn rotations_and_rates_belong_together() {
        let angles = |t: f64| [0.3 + 0.5 * t, -0.4 + 0.7 * t, 1.1 - 0.2 * t];
        let rate = body_rate(angles(0.0), [0.5, 0.7, -0.2]);
        let (before, after) = (from_angles(angles(-1e-6)), from_angles(angles(1e-6)));
        let slope: [f64; 4] = std::array::from_fn(|i| (after[i] - before[i]) / 2e-6);
        near(&slope, &quaternion_rate(from_angles(angles(0.0)), rate), 1e-9);
        let a = [0.2, -1.0, 0.7];
        near(&into_body(from_angles(angles(0.0)), into_world(from_angles(angles(0.0)), a)), &a, 1e-14);
        near(
            &into_world(from_angles([0.0, 0.0, std::f64::consts::FRAC_PI_2]), [1.0, 0.0, 0.0]),
            &[0.0, 1.0, 0.0],
            1e-14,
        );
    }

    #[test]
    fn rotation_between_attitudes_is_inverse_of_turning() {
        let from = from_angles([0.3, -0.4, 1.1]);
        for turn in [[0.02, -0.7, 1.1], [1e-9, 0.0, -2e-9], [0.0; 3]] {
            let to = turned(from, turn);
            near(&turn_between(from, to), &turn, 1e-14);
            near(&turn_between(from, to.map(|x| -x)), &turn, 1e-14);
            let a = [0.2, -1.0, 0.7];
            near(&into_world(to, a), &into_world(turned([1.0, 0.0, 0.0, 0.0], turn), into_world(from, a)), 1e-14);
        }
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let m = [[4.0, 0.2, -0.1], [0.2, 3.0, 0.5], [-0.1, 0.5, 5.0]];
        let a = [0.3, -0.9, 2.0];
        near(&times(&inverse(&m), times(&m, a)), &a, 1e-14);
        near(&times(&point_inertia(2.0, [0.0, 0.0, 3.0]), [1.0, 1.0, 1.0]), &[18.0, 18.0, 0.0], 1e-12);
    }
}
