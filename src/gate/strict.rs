//! How is JSON read that a program wrote? An object by its names, each of them once: a list in its place, or
//! a name that stands twice, is somebody's mistake, and no reader may choose what was meant.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// Numbers by name.
type Named = BTreeMap<String, f64>;

/// Numbers by name, each name once.
pub(super) fn named<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Named, D::Error> {
    deserializer.deserialize_map(Once)
}

/// The same, or `null`.
pub(super) fn named_if_any<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Named>, D::Error> {
    struct OnceOnly(Named);
    impl<'de> Deserialize<'de> for OnceOnly {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<OnceOnly, D::Error> {
            named(deserializer).map(OnceOnly)
        }
    }
    Ok(Option::<OnceOnly>::deserialize(deserializer)?.map(|found| found.0))
}

/// An object, or `null`.
pub(super) fn object_if_any<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Ok(Option::<Object<T>>::deserialize(deserializer)?.map(|object| object.0))
}

/// A list of objects, or `null`.
pub(super) fn objects_if_any<'de, D, T>(deserializer: D) -> Result<Option<Vec<T>>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    let found = Option::<Vec<Object<T>>>::deserialize(deserializer)?;
    Ok(found.map(|list| list.into_iter().map(|object| object.0).collect()))
}

struct Once;

impl<'de> Visitor<'de> for Once {
    type Value = Named;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object of numbers by name")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named, A::Error> {
        let mut found = Named::new();
        while let Some((name, value)) = map.next_entry::<String, f64>()? {
            if found.contains_key(&name) {
                return Err(A::Error::custom(format_args!("`{name}` stands twice")));
            }
            found.insert(name, value);
        }
        Ok(found)
    }
}

/// What is read from an object and nothing else: derived readers take the fields from a list as well, in
/// their order.
pub(super) struct Object<T>(pub T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Object<T>, D::Error> {
        deserializer.deserialize_map(OfObject(PhantomData)).map(Object)
    }
}

struct OfObject<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for OfObject<T> {
    type Value = T;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map))
    }
}
