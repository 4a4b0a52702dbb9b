//! Optimisers: what each owes its users, how good they are, and swarms of thousands.

mod contract;
mod large_swarms;
mod minimise;
mod optimisers;
mod scales;
