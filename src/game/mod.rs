//! Enough of the game to walk its maps: what stops a player, how they move, what they touch.

pub mod collision;
pub mod movement;
pub mod movers;
pub mod play;
pub mod recording;
pub mod triggers;
