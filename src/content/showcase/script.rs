//! The shader script of the show-case.

use std::fmt::Write;

/// Azimuth and elevation of the sun, degrees.
const SUN: (f64, f64) = (250.0, 50.0);

/// Area lights: shader, image, `q3map_surfacelight`.
const LIGHTS: [(&str, &str, u32); 10] = [
    ("light_coffer", "lamp_warm", 7000),
    ("light_sconce", "lamp_warm", 7000),
    ("light_strip", "lamp_cool", 5500),
    ("light_hall", "lamp_white", 4000),
    ("light_cellar", "lamp_amber", 16000),
    ("light_red", "lamp_red", 9000),
    ("light_teal", "lamp_teal", 7000),
    ("light_amber", "lamp_amber", 7000),
    ("light_violet", "lamp_violet", 10000),
    ("ember", "ember", 3500),
];

/// Unit vector towards the sun.
pub fn sun_direction() -> [f32; 3] {
    let (azimuth, elevation) = (SUN.0.to_radians(), SUN.1.to_radians());
    // Whole 4096ths hide any difference between machines' sines.
    let unit = [
        azimuth.cos() * elevation.cos(),
        azimuth.sin() * elevation.cos(),
        elevation.sin(),
    ];
    unit.map(|c| ((c * 4096.0).round() / 4096.0) as f32)
}

/// Text of `scripts/showcase.shader`.
pub fn text() -> String {
    let mut text =
        String::from("// Shaders of the q3rays show-case map. Made by the generator in src/content: edit there.\n\n");
    for (shader, image, light) in LIGHTS {
        let _ = write!(
            text,
            "textures/showcase/{shader}\n{{\n\tsurfaceparm nomarks\n\tsurfaceparm nodlight\n\tq3map_surfacelight {light}\n\
             \t{{\n\t\tmap textures/showcase/{image}.png\n\t\trgbGen identity\n\t}}\n}}\n\n"
        );
    }
    let (azimuth, elevation) = SUN;
    let _ = write!(
        text,
        "textures/showcase/sky\n{{\n\tsurfaceparm sky\n\tsurfaceparm noimpact\n\tsurfaceparm nolightmap\n\
         \tsurfaceparm nodlight\n\tq3map_sunExt 1 0.86 0.62 800 {azimuth} {elevation} 0.5 16\n\tq3map_surfacelight 900\n\
         \tskyparms env/showcase 512 -\n}}\n\n"
    );
    text.push_str(
        "textures/showcase/grate\n{\n\tsurfaceparm trans\n\tsurfaceparm alphashadow\n\tsurfaceparm nomarks\n\tcull none\n\
         \t{\n\t\tmap textures/showcase/grate.png\n\t\talphaFunc GE128\n\t\tdepthWrite\n\t\trgbGen identity\n\t}\n}\n\n",
    );
    text.push_str(
        "textures/showcase/glass\n{\n\tsurfaceparm trans\n\tsurfaceparm nolightmap\n\tsurfaceparm nomarks\n\tcull none\n\
         \trt_ior 1.5\n\t{\n\t\tmap $whiteimage\n\t\tblendFunc filter\n\t\trgbGen const ( 0.95 0.985 0.97 )\n\t}\n}\n\n\
         textures/showcase/mirror\n{\n\tsurfaceparm nolightmap\n\tsurfaceparm nomarks\n\tportal\n\
         \t{\n\t\tmap $whiteimage\n\t\tblendFunc filter\n\t\trgbGen const ( 0.97 0.97 0.97 )\n\t\tdepthWrite\n\t}\n}\n",
    );
    text
}
