//! What of the shader language a map's materials use, for `q3rays info`.

use super::Scene;
use super::material::MaterialSource;
use super::records::*;
use std::collections::BTreeMap;

/// A feature and how to tell it.
type Feature = (&'static str, fn(&MaterialSource) -> bool);

fn any_stage(m: &MaterialSource, test: impl Fn(&Stage) -> bool) -> bool {
    m.program.stages.iter().any(test)
}

fn deforms(m: &MaterialSource, kinds: std::ops::RangeInclusive<u32>) -> bool {
    m.deforms.iter().any(|d| kinds.contains(&d.kind))
}

const FEATURES: &[Feature] = &[
    ("alphaFunc", |m| m.tests_alpha()),
    ("alphaGen", |m| any_stage(m, |s| s.alpha_source != SOURCE_CONSTANT)),
    ("animMap", |m| any_stage(m, |s| s.frames > 1)),
    ("autosprite", |m| deforms(m, DEFORM_AUTOSPRITE..=DEFORM_AUTOSPRITE2)),
    ("clampMap", |m| any_stage(m, |s| s.flags & STAGE_CLAMP != 0)),
    ("cull", |m| m.culls_otherwise()),
    ("deformVertexes", |m| deforms(m, DEFORM_WAVE..=DEFORM_MOVE)),
    ("emission that moves", |m| m.program.moving_emission),
    ("layer", |m| m.program.layer),
    ("polygonOffset or layer order", |m| m.lift > 0.0),
    ("portal", |m| m.portal),
    ("rgbGen wave", |m| any_stage(m, |s| s.rgb_source == SOURCE_WAVE)),
    ("tcGen environment", |m| any_stage(m, |s| s.tc_gen == TC_ENVIRONMENT)),
    ("tcGen vector", |m| any_stage(m, |s| s.tc_gen == TC_VECTOR)),
    ("tcMod", |m| !m.program.mods.is_empty()),
];

/// Materials of a scene by the features that they use, those of models included; and its fogs.
pub fn features(scene: &Scene) -> BTreeMap<&'static str, usize> {
    let mut out = BTreeMap::new();
    for (name, test) in FEATURES {
        let count = scene.material_sources.iter().filter(|m| test(m)).count();
        if count > 0 {
            out.insert(*name, count);
        }
    }
    if !scene.fogs.fogs.is_empty() {
        out.insert("fog", scene.fogs.fogs.len());
    }
    out
}
