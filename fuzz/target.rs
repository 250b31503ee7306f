//! One program for each target of `targets.rs`, which has the target's name.

#![no_main]

mod targets;

use libfuzzer_sys::fuzz_target;
use std::cell::RefCell;
use targets::Reading;

thread_local! {
    static READING: RefCell<Reading> = RefCell::new(
        targets::find(env!("CARGO_BIN_NAME")).ok_or("no target of this name").map(|t| Reading::new(t).expect("a folder")).expect("a target"),
    );
}

// Time and memory are limited by libFuzzer.
fuzz_target!(|input: &[u8]| {
    READING.with(|reading| reading.borrow_mut().check(input).map(drop).expect("one line"));
});
