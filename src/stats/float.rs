//! Serialization of floats that may be infinite or NaN: finite numbers as they are, others as text ("inf", "-inf",
//! "NaN"), because JSON cannot represent them.
//!
//! Use it with `#[serde(with = "float")]`.

use serde::{Deserialize, Deserializer, Serializer, de};

/// Serializes `x`.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
pub(super) fn serialize<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if x.is_finite() { serializer.serialize_f64(*x) } else { serializer.collect_str(x) }
}

/// Deserializes the output of [`serialize`].
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written {
        Number(f64),
        Text(String),
    }
    match Written::deserialize(deserializer)? {
        Written::Number(x) => Ok(x),
        Written::Text(text) => text.parse().map_err(de::Error::custom),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chi2, Estimate, Welch};

    #[test]
    fn infinities_survive_json() {
        let welch = Welch::test(&Estimate::exact(1.0), &Estimate::exact(2.0));
        let text = serde_json::to_string(&welch).unwrap();
        assert!(text.contains(r#""t":"-inf","dof":"inf","p":0.0"#), "{text}");
        assert_eq!(serde_json::from_str::<Welch>(&text).unwrap(), welch);

        let welch = Welch { t: f64::NAN, ..welch };
        let text = serde_json::to_string(&welch).unwrap();
        assert!(serde_json::from_str::<Welch>(&text).unwrap().t.is_nan(), "{text}");

        let chi2 = Chi2 { statistic: f64::INFINITY, dof: 3.0, p: 0.0, pooled: 0 };
        let text = serde_json::to_string(&chi2).unwrap();
        assert_eq!(serde_json::from_str::<Chi2>(&text).unwrap(), chi2);
        assert!(serde_json::from_str::<Chi2>(&text.replace("inf", "much")).is_err());
    }
}
