//! The benchmarks as a user calls them: what they write, that they go on where they were interrupted, and comparisons of runs.

use q3rays::output::exr_file;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn bench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_q3rays"))
        .arg("bench")
        .args(arguments)
        .output()
        .expect("program starts")
}

fn done(arguments: &[&str]) -> String {
    let output = bench(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON")
}

#[test]
fn frame_times_are_kept_and_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a");
    let text = out.to_str().expect("text");
    let call = [
        "showcase", "--size", "64x36", "--frames", "6", "--warmup", "2", "--runs", "2", "--out", text,
    ];
    assert!(done(&call).contains("showcase: p50"));
    let data = json(&out.join("data.json"));
    let map = &data["maps"][0];
    assert_eq!(
        (map["map"].as_str(), map["frames"].as_u64()),
        (Some("showcase"), Some(6))
    );
    assert_eq!(map["runs"].as_array().map(Vec::len), Some(2));
    assert!(map["summary"]["p50"].as_f64() > Some(0.0) && map["memory"].as_u64() > Some(0));
    assert!(map["rays"]["primary"].as_f64() == Some(64.0 * 36.0));
    let frames = std::fs::read_to_string(out.join("frames.csv")).expect("frames");
    assert_eq!(frames.lines().count(), 1 + 2 * 6);
    let page = std::fs::read_to_string(out.join("report.html")).expect("a page");
    let outside =
        ["http://", "https://", "<script", "<link"].map(|t| page.replace("http://www.w3.org/2000/svg", "").contains(t));
    assert!(
        page.contains("<svg") && outside == [false; 4],
        "the page needs other files: {outside:?}"
    );
    // The same again takes over what is there; something else is measured.
    done(&call);
    assert_eq!(json(&out.join("data.json"))["maps"][0], *map);
    let mut other = call;
    other[4] = "5";
    done(&other);
    let again = json(&out.join("data.json"));
    assert_eq!(again["maps"][0]["frames"].as_u64(), Some(5));
    let frames = std::fs::read_to_string(out.join("frames.csv")).expect("frames");
    assert_eq!(frames.lines().count(), 1 + 2 * 5);
    // A run is as it is; one whose times are doubled is slower.
    assert!(done(&["compare", text, text]).contains(": 0 worse, 0 better"));
    let slower = folder.path().join("slower.json");
    let with_median = |ms: f64| {
        let mut changed = again.clone();
        changed["maps"][0]["medians"]["mean"] = ms.into();
        changed["maps"][0]["medians"]["deviation"] = 0.01.into();
        changed.to_string()
    };
    std::fs::write(out.join("data.json"), with_median(4.0)).expect("written");
    std::fs::write(&slower, with_median(8.0)).expect("written");
    let told = done(&["compare", text, slower.to_str().expect("text")]);
    assert!(
        told.contains("worse: showcase: p50, ms: 4.0000e0 to 8.0000e0 (+100.0%)"),
        "{told}"
    );
    // Files that are something else are told, in a sentence.
    std::fs::write(&slower, "{\"kind\": \"error\", \"run\": 3}").expect("written");
    let output = bench(&["compare", text, slower.to_str().expect("text")]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("different kinds"), "{said}");
}

/// Time against error at a thumbnail's size: what is unbiased says so, and truths and results are taken over.
#[test]
fn errors_are_measured_and_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("text");
    let call = [
        "error", "showcase", "--size", "48x27", "--truth", "256", "--images", "2", "--stops", "0", "--out", out,
    ];
    done(&call);
    let data = json(&folder.path().join("data.json"));
    let view = &data["views"][0];
    let rows = view["rows"].as_array().expect("rows");
    assert!(rows.len() + view["left_out"].as_array().map_or(0, Vec::len) > 35);
    let row = |name: &str| {
        rows.iter()
            .find(|r| r["name"] == name)
            .unwrap_or_else(|| panic!("no row {name}"))
    };
    let error = |name: &str| row(name)["rel_mse"].as_f64().expect("a number");
    assert!(error("resampled 16") < error("resampled 1") && error("resampled 1, denoiser") < error("resampled 1"));
    let culled = ["all lights", "all lights, culling 0"].map(error);
    assert!(
        (culled[0] / culled[1] - 1.0).abs() < 0.02,
        "culling changes the picture: {culled:?}"
    );
    let mean = row("all lights")["mean_ratio"].as_f64().expect("a number");
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
    assert!(rows.iter().any(|r| r["front"] == true));
    let lines = std::fs::read_to_string(folder.path().join("errors.csv"))
        .expect("rows")
        .lines()
        .count();
    assert_eq!(lines, rows.len() + 1);
    let page = std::fs::read_to_string(folder.path().join("report.html")).expect("a page");
    assert!(page.contains("data:image/jpeg;base64,") && page.contains("<svg"));
    assert_eq!(
        std::fs::read_dir(folder.path().join("truths")).expect("truths").count(),
        1
    );
    done(&call);
    assert_eq!(json(&folder.path().join("data.json"))["views"][0], *view);
}

/// What the benchmarks of shown frames measure is of the images that they write, and denoised frames are nearer to the truth.
#[test]
fn shown_frames_are_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("d.json");
    let (path, pictures) = (file.to_str().expect("text"), folder.path().join("pictures"));
    let call = |name| [name, "showcase", "--size", "32x18", "--references", "8", "--json", path];
    let told = done(
        &[
            &call("denoiser")[..],
            &["--spawns", "1", "--pictures", pictures.to_str().expect("text")],
        ]
        .concat(),
    );
    let report = json(&file);
    let view = &report["views"][0];
    let figure = |images: &Value, name: &str| images[name].as_f64().expect("a figure");
    let [raw, still, moved] = [&view["raw"], &view["still"][1], &view["moved"]].map(|f| figure(f, "rel_mse_trimmed"));
    assert!(still < raw / 4.0 && moved < raw, "{raw} {still} {moved}");
    let mean = |name: &str| {
        let written = exr_file::read(&pictures.join(format!("showcase_0_{name}.exr")));
        let (width, height, planes) = written.expect("an image");
        assert_eq!((width, height, planes.len()), (32, 18, 3));
        let values = planes.iter().flat_map(|(_, v)| v).map(|v| f64::from(*v));
        values.sum::<f64>() / f64::from(width * height * 3)
    };
    let truth = 0.5 * (mean("reference_a") + mean("reference_b"));
    for (name, images) in [
        ("raw128", &view["raw_many"]),
        ("still64", &view["still"][1]),
        ("moved64", &view["moved"]),
    ] {
        assert!(
            (mean(name) / truth - figure(images, "mean_ratio")).abs() < 1e-6,
            "{name}: {told}"
        );
    }
    done(&call("motion"));
    let walk = &json(&file)["maps"][0];
    assert!(
        figure(walk, "flip") > 0.0 && walk["frames"].as_array().is_some_and(|f| f.len() > 20),
        "{walk}"
    );
    assert!(
        walk["frames"]
            .as_array()
            .expect("frames")
            .iter()
            .all(|f| figure(f, "flip") < 1.0)
    );
    assert_eq!(done(&call("culling")).matches("| showcase (").count(), 12);
}
