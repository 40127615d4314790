use super::*;
use crate::assets::bsp::Bsp;
use crate::assets::bsp::build::{Bounds, Entity, MapBuilder};

/// A hall of 2048 units with stairs, low blocks and a slope of boxes.
fn hall(change: impl FnOnce(&mut MapBuilder)) -> Bsp {
    let mut map = MapBuilder::new(Entity::new("worldspawn"));
    let grey = map.paint("textures/fixture/grey128", 64.0);
    change(&mut map);
    map.cell("hall", Bounds::new([0; 3], [2048, 2048, 1024]), [Some(grey); 6]);
    map.build().unwrap()
}

fn pillar(map: &mut MapBuilder, low: [i32; 3], high: [i32; 3]) {
    let grey = map.paint("textures/fixture/grey128", 64.0);
    map.pillar(Bounds::new(low, high), grey);
}

fn world(collision: &CollisionWorld) -> World<'_> {
    World { collision, placed: &[] }
}

fn standing(collision: &CollisionWorld, x: f32, y: f32) -> Body {
    let mut body = Body::at(Vec3::new(x, y, 40.0));
    for _ in 0..100 {
        body.step(&world(collision), &Command::default());
    }
    assert!(body.ground.is_some_and(|g| g.walkable), "{body:?}");
    body
}

fn go(yaw: f32) -> Command {
    Command {
        forward: 1.0,
        yaw,
        ..Command::default()
    }
}

fn within(value: f32, wanted: f32) {
    assert!((value / wanted - 1.0).abs() < 0.01, "{value}, not {wanted}");
}

#[test]
fn jumps_reach_their_height_and_do_not_repeat_while_held() {
    let collision = CollisionWorld::new(&hall(|_| {}));
    let mut body = standing(&collision, 1000.0, 1000.0);
    let floor = body.origin.z;
    assert!((floor - 24.125).abs() < 0.01, "an eighth over the floor: {floor}");
    let jump = Command {
        up: 1.0,
        ..Command::default()
    };
    let heights: Vec<f32> = (0..250)
        .map(|_| {
            body.step(&world(&collision), &jump);
            body.origin.z - floor
        })
        .collect();
    within(heights.iter().copied().fold(0.0, f32::max), 45.5625);
    // It lands after 2·270/800 seconds and stays there.
    let landed = heights.iter().skip(10).position(|h| *h < 0.3).unwrap() + 10;
    within(landed as f32 * STEP, 2.0 * JUMP / GRAVITY);
    assert!(heights[landed..].iter().all(|h| *h < 0.3));
}

#[test]
fn running_crouching_and_stopping() {
    let collision = CollisionWorld::new(&hall(|_| {}));
    let mut body = standing(&collision, 100.0, 1000.0);
    for _ in 0..125 {
        body.step(&world(&collision), &go(0.0));
    }
    within(body.velocity.length(), 320.0);
    within(body.velocity.x, 320.0);
    let x = body.origin.x;
    let mut steps = 0u32;
    while body.velocity.length() > 0.0 {
        body.step(&world(&collision), &Command::default());
        steps += 1;
    }
    // e^(−6t) from 320 to 100, then 600 units/s² to nothing.
    let by_step = std::iter::successors(Some(320.0f32), |v| {
        Some(v - v.max(100.0) * FRICTION * STEP).filter(|v| *v >= 1.0)
    });
    let speeds: Vec<f32> = by_step.skip(1).collect();
    assert!(steps.abs_diff(speeds.len() as u32 + 1) <= 1, "{steps} steps");
    within(body.origin.x - x, speeds.iter().sum::<f32>() * STEP);
    within(steps as f32 * STEP, 3.2f32.ln() / FRICTION + 100.0 / 600.0);
    let crouched = Command { up: -1.0, ..go(0.0) };
    for _ in 0..250 {
        body.step(&world(&collision), &crouched);
    }
    within(body.velocity.length(), 80.0);
    assert!(body.crouched && body.eye().z < body.origin.z + 13.0);
    // Aslant is no faster.
    let aslant = Command {
        right: 1.0,
        ..go(180.0)
    };
    for _ in 0..250 {
        body.step(&world(&collision), &aslant);
    }
    within(body.velocity.length(), 320.0);
}

#[test]
fn steps_of_18_are_walked_up_and_19_are_not() {
    let bsp = hall(|map| {
        pillar(map, [400, 0, 0], [800, 900, 18]);
        pillar(map, [400, 1000, 0], [800, 2048, 19]);
    });
    let collision = CollisionWorld::new(&bsp);
    let walked = |y: f32| {
        let mut body = standing(&collision, 300.0, y);
        let mut lowest = 0f32;
        for _ in 0..125 {
            body.step(&world(&collision), &go(0.0));
            lowest = lowest.max(body.view_lag);
        }
        (body, lowest)
    };
    let (up, lag) = walked(500.0);
    assert!(up.origin.x > 500.0 && (up.origin.z - 42.125).abs() < 0.1, "{up:?}");
    assert!(lag > 10.0 && up.view_lag < 1.0, "the view follows smoothly");
    let (stopped, _) = walked(1500.0);
    assert!((stopped.origin.x - (400.0 - 15.125)).abs() < 0.3, "{stopped:?}");
}

#[test]
fn falls_follow_gravity_from_any_frame_rate() {
    let collision = CollisionWorld::new(&hall(|_| {}));
    let mut body = Body::at(Vec3::new(1000.0, 1000.0, 900.0));
    for _ in 0..125 {
        body.step(&world(&collision), &Command::default());
    }
    within(900.0 - body.origin.z, 0.5 * GRAVITY);
    within(-body.velocity.z, GRAVITY);
}

/// Turning in the air gains speed: at the best angle v² grows by 2·a·(320 − a) + a² a step, a = 320·STEP.
#[test]
fn strafe_jumps_gain_speed() {
    let mut body = Body {
        velocity: Vec3::new(320.0, 0.0, 0.0),
        ..Body::at(Vec3::new(1024.0, 1024.0, 1000.0))
    };
    let collision = CollisionWorld::new(&hall(|_| {}));
    let a = SPEED * STEP * AIR_ACCELERATION;
    let steps = 100;
    for _ in 0..steps {
        // Back to the middle: only the speed is of interest.
        body.origin = Vec3::new(1024.0, 1024.0, 900.0);
        body.velocity.z = 0.0;
        let speed = body.velocity.length();
        let off = ((SPEED - a) / speed).min(1.0).acos().to_degrees();
        let course = body.velocity.y.atan2(body.velocity.x).to_degrees();
        body.step(&world(&collision), &go(course + off));
    }
    let gained = 320.0f32.powi(2) + steps as f32 * (2.0 * a * (SPEED - a) + a * a);
    within(body.velocity.truncate().length(), gained.sqrt());
    // Straight ahead nothing is gained.
    let mut straight = Body {
        velocity: Vec3::new(320.0, 0.0, 0.0),
        ..Body::at(Vec3::new(1024.0, 1024.0, 900.0))
    };
    for _ in 0..50 {
        straight.origin = Vec3::new(1024.0, 1024.0, 900.0);
        straight.step(&world(&collision), &go(0.0));
    }
    within(straight.velocity.truncate().length(), 320.0);
}

#[test]
fn corners_stop_and_walls_are_slid_along() {
    let collision = CollisionWorld::new(&hall(|_| {}));
    let mut body = standing(&collision, 1900.0, 1000.0);
    // Aslant at the wall x = 2048: along it.
    for _ in 0..250 {
        body.step(&world(&collision), &go(45.0));
    }
    assert!((body.origin.x - (2048.0 - 15.125)).abs() < 0.2, "{body:?}");
    assert!(body.velocity.y > 200.0 && body.velocity.x.abs() < 1.0, "{body:?}");
    for _ in 0..500 {
        body.step(&world(&collision), &go(45.0));
    }
    assert!(
        body.velocity.length() < 2.0 && (body.origin.y - (2048.0 - 15.125)).abs() < 0.2,
        "{body:?}"
    );
}

#[test]
fn low_ceilings_keep_one_crouched() {
    let bsp = hall(|map| pillar(map, [400, 400, 48], [900, 900, 200]));
    let collision = CollisionWorld::new(&bsp);
    let mut body = standing(&collision, 300.0, 600.0);
    let crouched = Command { up: -1.0, ..go(0.0) };
    for _ in 0..400 {
        body.step(&world(&collision), &crouched);
    }
    assert!(body.origin.x > 450.0, "{body:?}");
    for _ in 0..50 {
        body.step(&world(&collision), &Command::default());
    }
    assert!(body.crouched, "there is no room to stand up");
    for _ in 0..900 {
        body.step(&world(&collision), &crouched);
    }
    body.step(&world(&collision), &Command::default());
    assert!(body.origin.x > 920.0 && !body.crouched, "{body:?}");
}

#[test]
fn noclip_and_flight() {
    let collision = CollisionWorld::new(&hall(|_| {}));
    let fly = |mode: Mode| {
        let mut body = Body {
            mode,
            ..Body::at(Vec3::new(1900.0, 1000.0, 500.0))
        };
        for _ in 0..250 {
            body.step(&world(&collision), &go(0.0));
        }
        body.origin
    };
    assert!(fly(Mode::NoClip).x > 2300.0);
    let stopped = fly(Mode::Fly);
    assert!(
        stopped.x < 2048.0 - 15.0 && (stopped.z - 500.0).abs() < 0.1,
        "{stopped}"
    );
}
