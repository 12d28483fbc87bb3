//! Drawn bodies against closed forms and the reference.
