//! The field table: every parameter, state and metric is declared once, with its unit and meaning.
//!
//! [`bundle!`](crate::bundle) turns one declaration into the generic Rust struct, its flat list of
//! scalars (for buffers, lanes and the tracer) and the [`Field`] rows that name the WGSL struct
//! members, the Parquet columns and the dispersible parameters.

use crate::range::Range;
use crate::real::Real;

/// One scalar of a bundle, as buffers, WGSL structs and Parquet columns see it.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Flat snake_case name, unique inside its bundle (`approach_offset_y`).
    pub name: String,
    /// SI unit, `1` for a pure number.
    pub unit: &'static str,
    /// What the number means, with its frame.
    pub meaning: &'static str,
    /// The legal values; only what a user may write has some.
    pub range: Option<Range>,
    /// The value at which the number changes nothing.
    pub null: f64,
    /// The effect without which the number stays 0, by its catalogue id; `None` for a number that every run has.
    pub effect: Option<&'static str>,
}

impl Field {
    /// A number that every run has.
    pub fn new(name: impl Into<String>, unit: &'static str, meaning: &'static str) -> Self {
        Self { name: name.into(), unit, meaning, range: None, null: 0.0, effect: None }
    }

    /// The name with its unit as a suffix, as Parquet columns are called (`target_mass_kg`).
    pub fn column(&self) -> String {
        match unit_suffix(self.unit) {
            "" => self.name.clone(),
            suffix => format!("{}_{suffix}", self.name),
        }
    }
}

/// The column suffix of a unit; empty for pure numbers.
pub fn unit_suffix(unit: &str) -> &'static str {
    match unit {
        "1" | "bits" => "",
        "kg" => "kg",
        "kg m^2" => "kg_m2",
        "m" => "m",
        "s" => "s",
        "ns" => "ns",
        "N" => "n",
        "J" => "j",
        "rad" => "rad",
        "m/s" => "m_per_s",
        "m/s^2" => "m_per_s2",
        "rad/s" => "rad_per_s",
        "N m" => "n_m",
        "N s" => "n_s",
        "N/m" => "n_per_m",
        "m/N" => "m_per_n",
        "N s/m" => "n_s_per_m",
        "N m/rad" => "n_m_per_rad",
        "N m s/rad" => "n_m_s_per_rad",
        "s/m" => "s_per_m",
        "N/s" => "n_per_s",
        "N m/s" => "n_m_per_s",
        "kg m/s" => "kg_m_per_s",
        "kg m^2/s" => "kg_m2_per_s",
        "Hz" => "hz",
        "1/s" => "per_s",
        other => panic!("unit `{other}` has no column suffix: add it to unit_suffix"),
    }
}

/// Where the scalars of a bundle come from: any closure; in hot lane code a type of its own, since a closure is not
/// compiled for the lanes' instruction set.
pub trait Source<R> {
    /// The next scalar.
    fn next(&mut self) -> R;
}

impl<R, F: FnMut() -> R> Source<R> for F {
    #[inline(always)]
    fn next(&mut self) -> R {
        self()
    }
}

/// Where the scalars of a bundle go; see [`Source`].
pub trait Sink<R> {
    /// Takes the next scalar.
    fn put(&mut self, value: R);
}

impl<R, F: FnMut(R)> Sink<R> for F {
    #[inline(always)]
    fn put(&mut self, value: R) {
        self(value);
    }
}

/// A value made of a fixed list of scalars: a bundle, or a leaf of one.
pub trait Bundle<R>: Sized {
    /// Appends one [`Field`] per scalar, in the order of [`read`](Self::read) and [`write`](Self::write).
    fn describe(name: &str, unit: &'static str, meaning: &'static str, out: &mut Vec<Field>);
    /// Builds the value from its scalars.
    fn read(source: &mut impl Source<R>) -> Self;
    /// Gives out the scalars.
    fn write(&self, sink: &mut impl Sink<R>);
    /// Takes over the scalars of another value where the mask holds.
    fn set_where(&mut self, mask: R::Mask, value: &Self)
    where
        R: Real;
}

/// The bare name of a bundle's type, as its WGSL struct is called.
pub fn bundle_name<B>() -> &'static str {
    let path = std::any::type_name::<B>();
    let bare = path.split('<').next().unwrap_or(path);
    bare.rsplit("::").next().unwrap_or(bare)
}

/// The rows of a bundle's field table.
pub fn fields<R, B: Bundle<R>>() -> Vec<Field> {
    let mut out = Vec::new();
    B::describe("", "1", "", &mut out);
    out
}

/// A bundle from a slice of its scalars.
pub fn from_slice<R: Copy, B: Bundle<R>>(values: &[R]) -> B {
    let mut values = values.iter().copied();
    B::read(&mut || values.next().expect("a slice as long as the bundle's field table"))
}

/// A bundle of equal scalars.
#[inline(always)]
pub fn filled<R: Copy, B: Bundle<R>>(value: R) -> B {
    B::read(&mut || value)
}

/// A bundle with the same fields as literals.
pub fn literal<R: Real, A: Bundle<f64>, B: Bundle<R>>(values: &A) -> B {
    let mut values = to_vec(values).into_iter();
    B::read(&mut || R::lit(values.next().expect("the same fields")))
}

/// The scalars of a bundle.
pub fn to_vec<R, B: Bundle<R>>(bundle: &B) -> Vec<R> {
    let mut out = Vec::new();
    bundle.write(&mut |value| out.push(value));
    out
}

/// `prefix_name`, or `name` alone at the top.
pub fn join(prefix: &str, name: &str) -> String {
    if prefix.is_empty() { name.to_owned() } else { format!("{prefix}_{name}") }
}

/// Declares a leaf: a scalar newtype-free value whose components get the given suffixes.
macro_rules! leaf {
    ($ty:ty, [$($suffix:literal => $($part:tt).+),*]) => {
        impl<R: Copy> Bundle<R> for $ty {
            fn describe(name: &str, unit: &'static str, meaning: &'static str, out: &mut Vec<Field>) {
                $(out.push(Field::new(join(name, $suffix), unit, meaning));)*
            }
            #[inline(always)]
            fn read(source: &mut impl Source<R>) -> Self {
                let mut value = <$ty>::splat(source.next());
                let mut first = true;
                $(if first { first = false; } else { value.$($part).+ = source.next(); })*
                let _ = first;
                value
            }
            #[inline(always)]
            fn write(&self, sink: &mut impl Sink<R>) {
                $(sink.put(self.$($part).+);)*
            }
            #[inline(always)]
            fn set_where(&mut self, mask: R::Mask, value: &Self)
            where
                R: Real,
            {
                $(self.$($part).+ = R::select(mask, value.$($part).+, self.$($part).+);)*
            }
        }
    };
}

leaf!(crate::vector::Vec3<R>, ["x" => x, "y" => y, "z" => z]);
leaf!(crate::vector::Quat<R>, ["w" => w, "x" => v.x, "y" => v.y, "z" => v.z]);
leaf!(crate::vector::Mat3<R>, [
    "x_x" => x.x, "x_y" => x.y, "x_z" => x.z,
    "y_x" => y.x, "y_y" => y.y, "y_z" => y.z,
    "z_x" => z.x, "z_y" => z.y, "z_z" => z.z
]);
leaf!(crate::vector::Sym3<R>, ["xx" => xx, "yy" => yy, "zz" => zz, "xy" => xy, "xz" => xz, "yz" => yz]);

impl<R, const N: usize, T: Bundle<R> + Copy> Bundle<R> for [T; N] {
    fn describe(name: &str, unit: &'static str, meaning: &'static str, out: &mut Vec<Field>) {
        for index in 0..N {
            T::describe(&join(name, &index.to_string()), unit, meaning, out);
        }
    }
    #[inline(always)]
    fn read(source: &mut impl Source<R>) -> Self {
        if N == 0 {
            return std::array::from_fn(|_| unreachable!("no element"));
        }
        let mut value = [T::read(source); N];
        for element in value.iter_mut().skip(1) {
            *element = T::read(source);
        }
        value
    }
    #[inline(always)]
    fn write(&self, sink: &mut impl Sink<R>) {
        for value in self {
            value.write(sink);
        }
    }
    #[inline(always)]
    fn set_where(&mut self, mask: R::Mask, value: &Self)
    where
        R: Real,
    {
        for i in 0..N {
            self[i].set_where(mask, &value[i]);
        }
    }
}

impl<R: Real> Bundle<R> for R {
    fn describe(name: &str, unit: &'static str, meaning: &'static str, out: &mut Vec<Field>) {
        out.push(Field::new(name, unit, meaning));
    }
    #[inline(always)]
    fn read(source: &mut impl Source<R>) -> Self {
        source.next()
    }
    #[inline(always)]
    fn write(&self, sink: &mut impl Sink<R>) {
        sink.put(*self);
    }
    #[inline(always)]
    fn set_where(&mut self, mask: R::Mask, value: &Self) {
        *self = R::select(mask, *value, *self);
    }
}

/// Gives described numbers their legal values.
pub fn keep_within(range: Range, described: &mut [Field]) {
    described.iter_mut().for_each(|field| field.range = Some(range));
}

/// Gives described numbers the value at which they change nothing.
pub fn change_nothing_at(null: f64, described: &mut [Field]) {
    described.iter_mut().for_each(|field| field.null = null);
}

/// Names the effects of described numbers: each effect has an equal share of them, in order.
pub fn belong_to(effects: &[&'static str], described: &mut [Field]) {
    let share = described.len() / effects.len();
    for (index, field) in described.iter_mut().enumerate() {
        field.effect = effects.get(index / share).copied();
    }
}

/// Declares a bundle: `name: type, unit, meaning;` per field.
///
/// What a user may write has its range before the meaning, `in Range::within(0.0, 1.0)`, and `null 1.0` if it changes nothing
/// at another value than 0. A field that stays 0 without an effect ends by `, of "K10_fixture"`; the elements of a list may have one each.
/// The struct is generic over the scalar `R` and, with `<N>`, over the number of arm joints.
#[macro_export]
macro_rules! bundle {
    (
        $(#[$doc:meta])*
        $name:ident $(<$n:ident>)? {
            $($field:ident : $ty:ty, $unit:literal $(, in $range:expr)? $(, null $null:expr)?, $meaning:literal
                $(, of $($effect:literal),+)?;)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name<R $(, const $n: usize)?> {
            $(#[doc = concat!($meaning, " \\[", $unit, "\\]")] pub $field: $ty,)*
        }

        impl<R: Copy + $crate::fields::Bundle<R> $(, const $n: usize)?> $crate::fields::Bundle<R> for $name<R $(, $n)?> {
            fn describe(name: &str, _unit: &'static str, _meaning: &'static str, out: &mut Vec<$crate::fields::Field>) {
                $(
                    let _first = out.len();
                    <$ty as $crate::fields::Bundle<R>>::describe(
                        &$crate::fields::join(name, stringify!($field)), $unit, $meaning, out);
                    $($crate::fields::keep_within($range, &mut out[_first..]);)?
                    $($crate::fields::change_nothing_at($null, &mut out[_first..]);)?
                    $(
                        $crate::fields::belong_to(&[$($effect),+], &mut out[_first..]);
                    )?
                )*
            }
            #[inline(always)]
            fn read(source: &mut impl $crate::fields::Source<R>) -> Self {
                Self { $($field: <$ty as $crate::fields::Bundle<R>>::read(source),)* }
            }
            #[inline(always)]
            fn write(&self, sink: &mut impl $crate::fields::Sink<R>) {
                $($crate::fields::Bundle::<R>::write(&self.$field, sink);)*
            }
            #[inline(always)]
            fn set_where(&mut self, mask: R::Mask, value: &Self)
            where
                R: $crate::real::Real,
            {
                $($crate::fields::Bundle::<R>::set_where(&mut self.$field, mask, &value.$field);)*
            }
        }
    };
}
