//! Values that measures derive from a whole run and share: each is made where it is first asked for, and
//! once.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Values that follow from a run as read, one of each type.
#[derive(Default)]
pub struct Derived(Mutex<HashMap<TypeId, Arc<dyn Any + Send + Sync>>>);

impl Derived {
    /// The run's value of this type. `make` is called where there is none yet, and may ask for no other.
    pub fn get<T: Any + Send + Sync>(&self, make: impl FnOnce() -> T) -> Arc<T> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = known.get(&TypeId::of::<T>()).and_then(|value| Arc::clone(value).downcast().ok()) {
            return value;
        }
        let value = Arc::new(make());
        known.insert(TypeId::of::<T>(), Arc::clone(&value) as _);
        value
    }
}
