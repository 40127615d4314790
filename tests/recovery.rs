//! Recovery of stripped lights: encodings of the installed maps.
mod common;
use q3rays::recovery::encoding::Encoding;
use q3rays::scene::Scene;

#[test]
#[ignore]
fn encodings() {
    let files = common::installed();
    for map in files.maps() {
        let scene = Scene::load(&files.focused_on(&map.name), &map.name).unwrap();
        let e = Encoding::of(&scene.bsp, &scene.entities, &scene.lights);
        println!("{:20} {:.3} {:.3} {:?}", map.name, e.gamma, e.compensate, e.evidence);
    }
}


fn maps() -> Vec<String> {
    match std::env::var("MAPS") {
        Ok(list) => list.split(',').map(str::to_owned).collect(),
        Err(_) => common::installed().maps().into_iter().map(|m| m.name).filter(|n| n != "showcase").collect(),
    }
}

#[test]
#[ignore]
fn table() {
    use q3rays::recovery::{Options, recover};
    let files = common::installed();
    let options = Options { hide_entities: true, hold_out_surfaces: std::env::var("HOLD").is_ok(), ..Options::default() };
    for name in maps() {
        let t = std::time::Instant::now();
        let scene = Scene::load(&files.focused_on(&name), &name).unwrap();
        let r = match recover(&scene, &options, &|_| {}) { Ok(r) => r, Err(e) => { println!("{e}"); continue; } };
        let s = &r.scores;
        let f = |s: q3rays::recovery::score::Score| format!("{:.3}/{:.2}", s.correlation, s.ratio);
        println!("{:15} g {:.1} lights {:3} known {} scaled {} direct {} noind {} full {} ind {:.2} amb {:.3} sky {:.3} t {:.1}",
            name, r.encoding.gamma, r.lights.len(), f(s.known), f(s.known_scaled), f(s.direct), f(s.without_indirect), f(s.full), r.indirect, r.ambient.y, r.sky.y, t.elapsed().as_secs_f32());
        if std::env::var("VERBOSE").is_ok() {
            println!("   {:?}", r.timings.iter().map(|(n, d)| format!("{n} {:.1}", d.as_secs_f32())).collect::<Vec<_>>());
            println!("   {:?}", r.scales.iter().map(|t| format!("{} {:.2}", t.name, t.scale)).collect::<Vec<_>>());
        }
        truth(&scene, &r);
    }
}

fn truth(scene: &Scene, r: &q3rays::recovery::Recovery) {
    use q3rays::scene::lights::LightSource;
    let truth: Vec<(glam::Vec3, f32)> = scene.lights.lights.iter().zip(&scene.lights.sources)
        .filter(|(_, s)| matches!(s, LightSource::PointEntity | LightSource::SpotEntity))
        .map(|(l, _)| (glam::Vec3::from(l.p0), l.p2[2] * 255.0)).collect();
    if truth.is_empty() || r.lights.is_empty() { return; }
    let mut d: Vec<(f32, f32)> = truth.iter().map(|(p, n)| r.lights.iter().map(|l| (l.position.distance(*p), l.power.max_element() / n)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1e9, 0.0))).collect();
    let within = |x: f32| d.iter().filter(|(d, _)| *d <= x).count();
    let (w16, w32, w48, w64) = (within(16.0), within(32.0), within(48.0), within(64.0));
    let mut ratios: Vec<f32> = d.iter().filter(|(d, _)| *d <= 48.0).map(|(_, r)| *r).collect();
    ratios.sort_by(f32::total_cmp);
    println!("   truth {}: found {} | within 16: {w16} 32: {w32} 48: {w48} 64: {w64} | power {:.3}", truth.len(), r.lights.len(), ratios.get(ratios.len() / 2).copied().unwrap_or(0.0));
    if std::env::var("VERBOSE").is_ok() {
        let mut all: Vec<_> = r.lights.iter().map(|l| (l.share, truth.iter().map(|t| t.0.distance(l.position)).fold(1e9f32, f32::min), l.power.max_element())).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        println!("      {}", all.iter().map(|(s, d, p)| format!("{:.2}%:{d:.0}:{p:.0}", s * 100.0)).collect::<Vec<_>>().join(" "));
        for ((p, n), (d, q)) in truth.iter().zip(&d) { if *d > 24.0 { let l = r.lights.iter().min_by(|a, b| a.position.distance(*p).total_cmp(&b.position.distance(*p))).unwrap();
            println!("      missed {p} N {n} nearest {d:.0} ratio {q:.2}: {}", l.position); } }
    }
    d.sort_by(|a, b| a.0.total_cmp(&b.0));
}

#[test]
#[ignore]
fn debug_known() {
    use q3rays::recovery::{luxels, visibility::Occluders, known, score::score};
    let files = common::installed();
    for name in maps() {
        let scene = Scene::load(&files.focused_on(&name), &name).unwrap();
        let e = Encoding::of(&scene.bsp, &scene.entities, &scene.lights);
        let all = luxels::all(&scene, &e);
        println!("{name}: {} luxels, {} clamped, surfaces {}", all.len(), all.iter().filter(|l| l.clamped).count(), scene.bsp.surfaces.len());
        let some: Vec<_> = all.iter().step_by(1 + all.len() / 5000).copied().filter(|l| !l.clamped).collect();
        let occ = Occluders::new(&scene);
        let terms = known::terms(&occ, &some, false, false, 1);
        for t in &terms { println!("  {} {:?}", t.name, t.values.iter().copied().sum::<glam::Vec3>() / some.len() as f32); }
        let sum: Vec<glam::Vec3> = (0..some.len()).map(|i| terms.iter().map(|t| t.values[i]).sum()).collect();
        println!("  mean stored {:?} {:?}", some.iter().map(|l| l.stored).sum::<glam::Vec3>() / some.len() as f32, score(&sum, &some.iter().map(|l| l.stored).collect::<Vec<_>>()));
        let mut worst: Vec<_> = some.iter().zip(&sum).collect();
        worst.sort_by(|a, b| (*b.1 - b.0.stored).abs().max_element().total_cmp(&(*a.1 - a.0.stored).abs().max_element()));
        for (l, p) in worst.iter().take(12).chain(worst.iter().skip(100).step_by(100).take(5)) {
            println!("    {} n {} area {:.0} stored {} pred {} surf {} kind {}", l.position, l.normal, l.area, l.stored, p, l.surface, scene.bsp.surfaces[l.surface as usize].kind);
        }
        let mut sum2 = std::collections::BTreeMap::new();
        for (l, p) in some.iter().zip(&sum) { let k = scene.bsp.shaders[scene.bsp.surfaces[l.surface as usize].shader as usize].name.text().into_owned(); let e: &mut Vec<(glam::Vec3, glam::Vec3)> = sum2.entry(k).or_default(); e.push((*p, l.stored)); }
        for (k, v) in sum2 { if v.len() > 60 { let (a, b): (Vec<_>, Vec<_>) = v.into_iter().unzip(); println!("   {k} {} {:?}", a.len(), score(&a, &b)); } }
    }
}

#[test]
#[ignore]
fn residuals() {
    use q3rays::recovery::{Options, recover};
    let files = common::installed();
    let options = Options { hide_entities: std::env::var("SHOW").is_err(), ..Options::default() };
    for name in maps() {
        let scene = Scene::load(&files.focused_on(&name), &name).unwrap();
        let r = recover(&scene, &options, &|_| {}).unwrap();
        println!("{name} {:?}", r.scores);
        truth(&scene, &r);
        let mut rows: Vec<_> = r.luxels.iter().filter(|l| l.held_out && !l.clamped).collect();
        let err = |l: &q3rays::recovery::recover::LuxelRow| (l.stored - l.known - l.recovered - l.indirect).length_squared();
        let total: f32 = rows.iter().map(|l| err(l)).sum();
        rows.sort_by(|a, b| err(b).total_cmp(&err(a)));
        let mut cum = 0.0;
        for (i, l) in rows.iter().enumerate() {
            cum += err(l);
            if i % (rows.len() / 400).max(1) == 0 && i < rows.len() / 8 { println!("  {:.2} {} n {} stored {:.2} known {:.2} rec {:.2} ind {:.2}", cum / total, l.position.round(), l.normal, l.stored, l.known, l.recovered, l.indirect); }
        }
        let mut by: std::collections::BTreeMap<u32, (usize, f32, f32, f32)> = Default::default();
        for l in &rows { let k = (l.stored.element_sum() / 3.0 * 255.0).log2().max(0.0) as u32; let e = by.entry(k).or_default(); e.0 += 1; e.1 += l.stored.element_sum(); e.2 += (l.known + l.recovered + l.indirect).element_sum(); e.3 += err(l); }
        for (k, v) in by { println!("  2^{k}: {} stored {:.4} pred {:.4} err {:.2}", v.0, v.1 / v.0 as f32 / 3.0, v.2 / v.0 as f32 / 3.0, v.3 / total); }
    }
}

#[test]
#[ignore]
fn known_only() {
    use q3rays::recovery::{Options, recover};
    let files = common::installed();
    let mut options = Options::default();
    options.limits.lights = 0;
    for name in maps() {
        let scene = Scene::load(&files.focused_on(&name), &name).unwrap();
        let r = recover(&scene, &options, &|_| {}).unwrap();
        let f = |s: q3rays::recovery::score::Score| format!("{:.3}/{:.2}", s.correlation, s.ratio);
        println!("{name:15} known {} scaled {} ind {:.2}", f(r.scores.known), f(r.scores.known_scaled), r.indirect);
    }
}
