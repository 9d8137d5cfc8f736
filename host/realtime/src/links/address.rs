//! Parses addresses of robots and sensors: `rsi://0.0.0.0:59152?from=192.168.1.20`.

use super::error::LinkError;
use crate::time::Nanos;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::str::FromStr;

/// An option of an address.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkOption {
    /// Name before the `=`.
    pub key: &'static str,
    /// Default value: a port, a cycle in ms, a rate in Hz.
    pub default: Option<f64>,
    /// An example value.
    pub example: &'static str,
    /// Whether only our side of the link has the option.
    pub ours_only: bool,
}

impl LinkOption {
    /// Creates a text option without a default.
    pub(crate) const fn text(key: &'static str, example: &'static str) -> Self {
        Self { key, default: None, example, ours_only: false }
    }

    /// Creates a numeric option.
    pub(crate) const fn number(key: &'static str, default: f64, example: &'static str) -> Self {
        Self { key, default: Some(default), example, ours_only: false }
    }

    /// Creates the option for the period of a robot's commands.
    pub(crate) const fn cycle(default: Nanos) -> Self {
        Self::number("cycle_ms", default.0 as f64 * 1e-6, "4")
    }
}

/// Creates the option for the only accepted host, for protocols whose controllers call us.
pub(crate) const FROM: LinkOption = LinkOption { key: "from", default: None, example: "192.168.1.20", ours_only: true };

/// The parts of an address.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkAddress {
    scheme: String,
    place: String,
    options: BTreeMap<String, String>,
    whole: String,
}

impl LinkAddress {
    /// Splits an address into its parts.
    ///
    /// # Errors
    /// If it has no scheme.
    pub fn parse(text: &str) -> Result<Self, LinkError> {
        let (scheme, rest) = text.split_once("://").ok_or_else(|| {
            LinkError::address(format!("`{text}` has no scheme"), "write one as rsi://0.0.0.0:59152 or emulated://")
        })?;
        let (place, options) = rest.split_once('?').unwrap_or((rest, ""));
        let options = options.split('&').filter(|option| !option.is_empty()).map(|option| {
            let (key, value) = option.split_once('=').unwrap_or((option, ""));
            (key.to_owned(), value.to_owned())
        });
        Ok(Self {
            scheme: scheme.to_owned(),
            place: place.trim_end_matches('/').to_owned(),
            options: options.collect(),
            whole: text.to_owned(),
        })
    }

    /// The protocol.
    pub fn scheme(&self) -> &str {
        &self.scheme
    }

    /// Host and, behind a colon, port; or a network interface.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Refuses unknown options.
    pub(super) fn only<'a>(&self, known: impl Iterator<Item = &'a LinkOption>) -> Result<(), LinkError> {
        let known: Vec<&str> = known.map(|option| option.key).collect();
        match self.options.keys().find(|key| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some(key) => {
                let what = format!("`{}`: {}:// has no option `{key}`", self.whole, self.scheme);
                Err(LinkError::address(what, format!("its options are: {}", known.join(", "))))
            }
        }
    }

    /// Resolves host and port; uses the protocol's default port.
    ///
    /// # Errors
    /// If the host does not exist.
    pub fn socket(&self, port: u16) -> Result<SocketAddr, LinkError> {
        let with_port = if self.place.contains(':') { self.place.clone() } else { format!("{}:{port}", self.place) };
        let found = with_port.to_socket_addrs().ok().and_then(|mut found| found.next());
        found.ok_or_else(|| {
            let what = format!("`{}`: `{with_port}` is not a resolvable HOST:PORT", self.whole);
            LinkError::address(what, "write 192.168.1.20:59152")
        })
    }

    /// Returns the listening address of an emulated device: loopback, unless the address states another.
    pub(super) fn listening(&self, port: u16) -> Result<SocketAddr, LinkError> {
        if self.place.is_empty() { Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port))) } else { self.socket(port) }
    }

    /// Parses the value of an option; `None` if it is absent.
    pub(super) fn option<T: FromStr>(&self, option: &LinkOption) -> Result<Option<T>, LinkError> {
        let LinkOption { key, example, .. } = option;
        self.options.get(*key).map_or(Ok(None), |text| {
            text.parse().map(Some).map_err(|_| {
                let what = format!("`{}`: `{key}={text}` cannot be read", self.whole);
                LinkError::address(what, format!("write {key}={example}"))
            })
        })
    }

    /// Returns a port option, or its default.
    pub(super) fn port(&self, option: &LinkOption) -> Result<u16, LinkError> {
        Ok(self.option(option)?.unwrap_or(option.default.unwrap_or_default() as u16))
    }

    /// Returns a numeric option, or its default.
    pub(super) fn number(&self, option: &LinkOption) -> Result<f64, LinkError> {
        Ok(self.option(option)?.unwrap_or(option.default.unwrap_or_default()))
    }

    /// Returns the option `from`: the only accepted host.
    pub(super) fn from(&self) -> Result<Option<IpAddr>, LinkError> {
        self.option(&FROM)
    }

    /// Returns the option `cycle_ms`, or the protocol's default cycle.
    pub(super) fn cycle(&self, option: &LinkOption) -> Result<Nanos, LinkError> {
        let millis = self.number(option)?;
        if !(0.1..=100.0).contains(&millis) {
            let what = format!("`{}`: a cycle of {millis} ms", self.whole);
            return Err(LinkError::address(what, "write 0.1 to 100 ms: cycle_ms=4"));
        }
        Ok(Nanos::from_seconds(millis * 1e-3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn address_parses_into_its_parts() {
        let cycle = LinkOption::cycle(Nanos::from_millis(4));
        let address = LinkAddress::parse("rsi://0.0.0.0:59152?from=10.0.0.7&cycle_ms=12").unwrap();
        assert_eq!((address.scheme(), address.socket(1).unwrap().port()), ("rsi", 59152));
        assert_eq!(address.from().unwrap(), Some("10.0.0.7".parse().unwrap()));
        assert_eq!(address.cycle(&cycle).unwrap(), Nanos::from_millis(12));
        assert!(address.only([FROM].iter()).is_err());
        assert_eq!(LinkAddress::parse("netft://127.0.0.1").unwrap().socket(49152).unwrap().port(), 49152);
        for wrong in ["rsi", "rsi://nowhere.invalid:x", "rsi://1.2.3.4:99999"] {
            assert!(LinkAddress::parse(wrong).and_then(|address| address.socket(1)).is_err(), "{wrong}");
        }
        assert!(LinkAddress::parse("rsi://a?cycle_ms=1e9").unwrap().cycle(&cycle).is_err());
    }
}
