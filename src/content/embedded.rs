//! The content that ships with the program, compiled in so that it works from any folder.

macro_rules! embed {
    ($($path:literal)*) => {
        /// Path and bytes of every file under `baseq3/`.
        pub const EMBEDDED: &[(&str, &[u8])] =
            &[$(($path, include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/baseq3/", $path)))),*];
    };
}

embed! {
    "env/showcase_bk.png"
    "env/showcase_dn.png"
    "env/showcase_ft.png"
    "env/showcase_lf.png"
    "env/showcase_rt.png"
    "env/showcase_up.png"
    "maps/showcase.bsp"
    "scripts/showcase.shader"
    "textures/showcase/brick.png"
    "textures/showcase/checker.png"
    "textures/showcase/concrete.png"
    "textures/showcase/door.png"
    "textures/showcase/ember.png"
    "textures/showcase/grate.png"
    "textures/showcase/lamp_amber.png"
    "textures/showcase/lamp_cool.png"
    "textures/showcase/lamp_red.png"
    "textures/showcase/lamp_teal.png"
    "textures/showcase/lamp_violet.png"
    "textures/showcase/lamp_warm.png"
    "textures/showcase/lamp_white.png"
    "textures/showcase/marble.png"
    "textures/showcase/metal.png"
    "textures/showcase/plaster.png"
    "textures/showcase/stone.png"
    "textures/showcase/tiles.png"
    "textures/showcase/trim.png"
    "textures/showcase/wood.png"
}
