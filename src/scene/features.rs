//! What of the shader language a map's materials use, for `q3rays info`.

use super::Scene;
use super::material::{MaterialSource, Visibility};
use super::records::*;
use crate::assets::shader_script::{AlphaFunc, Cull};
use std::collections::BTreeMap;

/// A feature and how to tell it.
type Feature = (&'static str, fn(&MaterialSource) -> bool);

fn any_stage(m: &MaterialSource, test: impl Fn(&Stage) -> bool) -> bool {
    m.program.stages.iter().any(test)
}

fn blends(m: &MaterialSource, source: u32, destination: u32) -> bool {
    any_stage(m, |s| (s.source, s.destination) == (source, destination))
}

/// Some stage blends by factors that have no name of their own.
fn blends_otherwise(m: &MaterialSource) -> bool {
    const NAMED: [(u32, u32); 5] = [
        (BLEND_ONE, BLEND_ZERO),
        (BLEND_ONE, BLEND_ONE),
        (BLEND_DST_COLOR, BLEND_ZERO),
        (BLEND_ZERO, BLEND_SRC_COLOR),
        (BLEND_SRC_ALPHA, BLEND_ONE_MINUS_SRC_ALPHA),
    ];
    any_stage(m, |s| !NAMED.contains(&(s.source, s.destination)))
}

fn changes(m: &MaterialSource, test: impl Fn(&TcMod) -> bool) -> bool {
    m.program.mods.iter().any(test)
}

fn deforms(m: &MaterialSource, kind: u32) -> bool {
    m.deforms.iter().any(|d| d.kind == kind)
}

const FEATURES: &[Feature] = &[
    ("alphaFunc GE128", |m| m.alpha_func == Some(AlphaFunc::Ge128)),
    ("alphaFunc GT0", |m| m.alpha_func == Some(AlphaFunc::Gt0)),
    ("alphaFunc LT128", |m| m.alpha_func == Some(AlphaFunc::Lt128)),
    ("alphaGen const", |m| {
        any_stage(m, |s| s.alpha_source == SOURCE_CONSTANT && s.alpha != 1.0)
    }),
    ("alphaGen lightingSpecular", |m| {
        any_stage(m, |s| s.alpha_source == SOURCE_SPECULAR)
    }),
    ("alphaGen portal", |m| any_stage(m, |s| s.alpha_source == SOURCE_PORTAL)),
    ("alphaGen vertex", |m| {
        any_stage(m, |s| matches!(s.alpha_source, SOURCE_VERTEX | SOURCE_ONE_MINUS_VERTEX))
    }),
    ("alphaGen wave", |m| any_stage(m, |s| s.alpha_source == SOURCE_WAVE)),
    ("animMap", |m| any_stage(m, |s| s.frames > 1)),
    ("blendFunc add", |m| blends(m, BLEND_ONE, BLEND_ONE)),
    ("blendFunc blend", |m| {
        blends(m, BLEND_SRC_ALPHA, BLEND_ONE_MINUS_SRC_ALPHA)
    }),
    ("blendFunc filter", |m| {
        m.visibility == Visibility::Layer
            && (blends(m, BLEND_DST_COLOR, BLEND_ZERO) || blends(m, BLEND_ZERO, BLEND_SRC_COLOR))
    }),
    ("blendFunc of other factors", blends_otherwise),
    ("clampMap", |m| any_stage(m, |s| s.flags & STAGE_CLAMP != 0)),
    ("cull back", |m| m.cull == Cull::BackSided),
    ("cull none", |m| m.cull == Cull::TwoSided),
    ("deformVertexes autosprite", |m| deforms(m, DEFORM_AUTOSPRITE)),
    ("deformVertexes autosprite2", |m| deforms(m, DEFORM_AUTOSPRITE2)),
    ("deformVertexes bulge", |m| deforms(m, DEFORM_BULGE)),
    ("deformVertexes move", |m| deforms(m, DEFORM_MOVE)),
    ("deformVertexes normal", |m| deforms(m, DEFORM_NORMAL)),
    ("deformVertexes wave", |m| deforms(m, DEFORM_WAVE)),
    ("dielectric", |m| m.dielectric.is_some()),
    ("emission that moves", |m| m.program.moving_emission),
    ("layer", |m| m.visibility == Visibility::Layer),
    ("polygonOffset or layer order", |m| m.lift > 0.0),
    ("portal", |m| m.portal),
    ("q3map_surfacelight", |m| m.surface_light().is_some()),
    ("rgbGen const", |m| {
        any_stage(m, |s| s.rgb_source == SOURCE_CONSTANT && s.rgb != [1.0; 3])
    }),
    ("rgbGen vertex", |m| {
        any_stage(m, |s| matches!(s.rgb_source, SOURCE_VERTEX | SOURCE_ONE_MINUS_VERTEX))
    }),
    ("rgbGen wave", |m| any_stage(m, |s| s.rgb_source == SOURCE_WAVE)),
    ("several stages", |m| m.program.stages.len() > 2),
    ("skyparms", |m| m.visibility == Visibility::Sky && m.sky_box.is_some()),
    ("skyparms clouds", |m| {
        m.visibility == Visibility::Sky && !m.program.stages.is_empty()
    }),
    ("tcGen environment", |m| any_stage(m, |s| s.tc_gen == TC_ENVIRONMENT)),
    ("tcGen lightmap", |m| {
        any_stage(m, |s| s.tc_gen == TC_LIGHTMAP && s.flags & STAGE_WHITE == 0)
    }),
    ("tcGen vector", |m| any_stage(m, |s| s.tc_gen == TC_VECTOR)),
    ("tcMod rotate", |m| changes(m, |c| c.kind == TC_ROTATE)),
    ("tcMod scale", |m| {
        changes(m, |c| c.kind == TC_AFFINE && c.matrix[1] == 0.0 && c.matrix[2] == 0.0)
    }),
    ("tcMod scroll", |m| changes(m, |c| c.kind == TC_SCROLL)),
    ("tcMod stretch", |m| changes(m, |c| c.kind == TC_STRETCH)),
    ("tcMod transform", |m| {
        changes(m, |c| c.kind == TC_AFFINE && (c.matrix[1] != 0.0 || c.matrix[2] != 0.0))
    }),
    ("tcMod turb", |m| changes(m, |c| c.kind == TC_TURBULENCE)),
    ("glossy reflection", |m| m.program.glossy),
];

/// Numbers of a scene's materials by the features that they use, those of models included.
pub fn materials_by_feature(scene: &Scene) -> Vec<(&'static str, Vec<u32>)> {
    FEATURES
        .iter()
        .map(|(name, test)| {
            let uses = |(i, m): (usize, &MaterialSource)| test(m).then_some(i as u32);
            let sources = scene.material_sources.iter().enumerate();
            (*name, sources.filter_map(uses).collect::<Vec<_>>())
        })
        .filter(|(_, materials)| !materials.is_empty())
        .collect()
}

/// Materials of a scene by the features that they use, those of models included; and its fogs.
pub fn features(scene: &Scene) -> BTreeMap<&'static str, usize> {
    let mut out: BTreeMap<_, _> = materials_by_feature(scene)
        .into_iter()
        .map(|(name, materials)| (name, materials.len()))
        .collect();
    if !scene.fogs.fogs.is_empty() {
        out.insert("fog", scene.fogs.fogs.len());
    }
    out
}
