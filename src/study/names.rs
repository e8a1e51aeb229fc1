//! How do camera parameters stand in a file? By their names.

/// A set of parameters as a list of names: `["fx", "fy"]`.
pub(super) mod free {
    use calibench::camera::{FreeParameters, Parameter};
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(free: &FreeParameters, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(free.iter().map(Parameter::name))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<FreeParameters, D::Error> {
        let names = Vec::<String>::deserialize(deserializer)?;
        names.iter().try_fold(FreeParameters::NONE, |set, name| {
            let parameter = name.parse().map_err(D::Error::custom)?;
            if set.contains(parameter) {
                return Err(D::Error::custom(format!("`{name}` stands twice in a list of parameters")));
            }
            Ok(set.with(parameter))
        })
    }
}

/// See [`free`].
#[derive(serde::Deserialize)]
pub(super) struct Free(#[serde(with = "free")] pub calibench::camera::FreeParameters);

/// A lens model by its name.
pub(super) mod model {
    use calibench::camera::Model;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn usual() -> Model {
        Model::BrownConrady
    }

    pub fn is_usual(model: &Model) -> bool {
        *model == usual()
    }

    pub fn serialize<S: Serializer>(model: &Model, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(model.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Model, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// Values by parameter: `{ k2 = 0.05 }`.
pub(super) mod held {
    use calibench::camera::Parameter;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};
    use std::collections::BTreeMap;

    pub fn serialize<S: Serializer>(
        held: &BTreeMap<Parameter, f64>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_map(held.iter().map(|(p, v)| (p.name(), v)))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<BTreeMap<Parameter, f64>, D::Error> {
        let named = BTreeMap::<String, f64>::deserialize(deserializer)?;
        let held = |(name, value): (String, f64)| {
            if !value.is_finite() {
                return Err(D::Error::custom(format!(
                    "`{name}` is held at {value}: it must be a finite number"
                )));
            }
            Ok((name.parse().map_err(D::Error::custom)?, value))
        };
        named.into_iter().map(held).collect()
    }
}
