//! What is rendered: triangles, materials, lights, clusters and views.

pub mod ambient;
pub mod blending;
pub mod bvh;
pub mod camera;
pub mod clock;
pub mod clusters;
pub mod dynamic_geometry;
pub mod emission;
pub mod entity_geometry;
pub mod features;
pub mod fog;
pub mod guests;
pub mod items;
pub mod light_cells;
pub mod light_power;
pub mod light_tree;
pub mod lights;
pub mod load;
pub mod material;
pub mod models;
pub mod motion;
pub mod optics;
pub mod player;
pub mod polygons;
pub mod portals;
pub mod program;
pub mod records;
pub mod report;
pub mod sampling;
pub mod spawns;
pub mod static_geometry;
pub mod textures;

pub use load::{Scene, SceneError};
