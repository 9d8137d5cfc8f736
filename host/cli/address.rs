//! Addresses of robots and sensors as they are typed: `rsi://0.0.0.0:59152?from=192.168.1.20`.

use crate::words::refuse;
use softdock_realtime::time::Nanos;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};

/// An address, cut into its parts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Address {
    /// The protocol.
    pub(crate) scheme: String,
    /// Host and, behind a colon, port.
    pub(crate) place: String,
    options: BTreeMap<String, String>,
    whole: String,
}

impl Address {
    /// Cuts an address into its parts.
    pub(crate) fn parse(text: &str) -> miette::Result<Self> {
        let (scheme, rest) = text.split_once("://").ok_or_else(|| {
            refuse(format!("`{text}` is no address"), "write one as rsi://0.0.0.0:59152 or emulated://")
        })?;
        let (place, options) = rest.split_once('?').unwrap_or((rest, ""));
        let options = options.split('&').filter(|option| !option.is_empty()).map(|option| {
            let (key, value) = option.split_once('=').unwrap_or((option, ""));
            (key.to_owned(), value.to_owned())
        });
        let address = Self {
            scheme: scheme.to_owned(),
            place: place.trim_end_matches('/').to_owned(),
            options: options.collect(),
            whole: text.to_owned(),
        };
        Ok(address)
    }

    /// Refuses options that the protocol does not have.
    pub(crate) fn only(&self, known: &[&str]) -> miette::Result<()> {
        match self.options.keys().find(|key| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some(key) => {
                let message = format!("`{}`: {}:// has no option `{key}`", self.whole, self.scheme);
                Err(refuse(message, format!("its options are: {}", known.join(", "))))
            }
        }
    }

    /// Host and port; the protocol's own port if none is written.
    pub(crate) fn socket(&self, port: u16) -> miette::Result<SocketAddr> {
        let with_port = if self.place.contains(':') { self.place.clone() } else { format!("{}:{port}", self.place) };
        let found = with_port.to_socket_addrs().ok().and_then(|mut found| found.next());
        found.ok_or_else(|| {
            refuse(format!("`{}`: `{with_port}` is no host and port", self.whole), "write 192.168.1.20:59152")
        })
    }

    /// An option, read as what it must be.
    pub(crate) fn option<T: std::str::FromStr>(&self, key: &str, example: &str) -> miette::Result<Option<T>> {
        self.options.get(key).map_or(Ok(None), |text| {
            text.parse().map(Some).map_err(|_| {
                refuse(format!("`{}`: `{key}={text}` cannot be read", self.whole), format!("write {key}={example}"))
            })
        })
    }

    /// The option `from`: the only host that may speak.
    pub(crate) fn from(&self) -> miette::Result<Option<IpAddr>> {
        self.option("from", "192.168.1.20")
    }

    /// The option `cycle_ms`, or the protocol's own.
    pub(crate) fn cycle(&self, default_ms: f64) -> miette::Result<Nanos> {
        let millis: f64 = self.option("cycle_ms", "4")?.unwrap_or(default_ms);
        if !(0.1..=100.0).contains(&millis) {
            let message = format!("`{}`: a cycle of {millis} ms", self.whole);
            return Err(refuse(message, "write 0.1 to 100 ms: cycle_ms=4"));
        }
        Ok(Nanos::from_seconds(millis * 1e-3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_cut_into_its_parts() {
        let address = Address::parse("rsi://0.0.0.0:59152?from=10.0.0.7&cycle_ms=12").unwrap();
        assert_eq!((address.scheme.as_str(), address.socket(1).unwrap().port()), ("rsi", 59152));
        assert_eq!(address.from().unwrap(), Some("10.0.0.7".parse().unwrap()));
        assert_eq!(address.cycle(4.0).unwrap(), Nanos::from_millis(12));
        assert!(address.only(&["from"]).is_err());
        assert_eq!(Address::parse("netft://127.0.0.1").unwrap().socket(49152).unwrap().port(), 49152);
        for wrong in ["rsi", "rsi://nowhere.invalid:x", "rsi://1.2.3.4:99999"] {
            assert!(Address::parse(wrong).and_then(|address| address.socket(1)).is_err(), "{wrong}");
        }
        assert!(Address::parse("rsi://a?cycle_ms=1e9").unwrap().cycle(4.0).is_err());
    }
}
