//! Optimisers: what each owes its users, how good they are, and swarms of thousands.

mod large_swarms;
mod optimisers;
