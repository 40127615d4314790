//! Moving about in real maps: traces against brute force, nobody leaves the world, doors, jump pads and teleporters.

mod common;

use common::installed;
use glam::Vec3;
use q3rays::assets::bsp::Bsp;
use q3rays::assets::bsp::lumps::content_flags;
use q3rays::assets::entities::{Entity, parse};
use q3rays::assets::vfs::FileSource;
use q3rays::assets::vfs::search_path::map_path;
use q3rays::game::collision::{CollisionWorld, Extent, PLAYER_SOLID};
use q3rays::game::movement::{Command, Mode, STEP, extent};
use q3rays::game::movers::Kind;
use q3rays::game::play::{Event, Play};
use q3rays::scene::clock::Clock;
use q3rays::scene::sampling::{key, unit};
use q3rays::scene::spawns::spawns;

const MAPS: [&str; 10] = [
    "oa_dm1",
    "am_galmevish2",
    "ctf_compromise",
    "oa_minia",
    "kaos",
    "wrackdm17",
    "slimefac",
    "oa_koth2",
    "aggressor",
    "oa_rpg3dm2",
];

fn map(name: &str) -> (Bsp, Vec<Entity>) {
    let files = installed();
    let bytes = files
        .read(&map_path(name))
        .unwrap()
        .unwrap_or_else(|| panic!("no map {name}"));
    let bsp = Bsp::read(&bytes).unwrap();
    let entities = parse(&bsp.entities).0;
    (bsp, entities)
}

fn play(name: &str) -> Play {
    let (bsp, entities) = map(name);
    Play::new(&bsp, &entities, &spawns(&entities))
}

/// Numbers 0..1.
fn random(map: usize, i: u32, d: u32) -> f32 {
    unit(key(map as u32 + 1, i, d))
}

#[test]
fn traces_through_the_tree_are_those_against_everything() {
    let sizes = [extent(false), extent(true), Extent::POINT];
    for (number, name) in MAPS.iter().enumerate() {
        let (bsp, _) = map(name);
        let world = CollisionWorld::new(&bsp);
        let bounds = bsp.world_bounds();
        let (mut hits, mut apart) = (0, 0);
        for i in 0..10_000 {
            let at = |d: u32| Vec3::new(random(number, i, d), random(number, i, d + 1), random(number, i, d + 2));
            let start = bounds.min + (bounds.max - bounds.min) * at(0);
            let way = (at(3) - 0.5) * if i % 2 == 0 { 64.0 } else { 2048.0 };
            let size = sizes[i as usize % 3];
            let tree = world.sweep(size, start, start + way, PLAYER_SOLID, &[]);
            let all = world.sweep_all(size, start, start + way, PLAYER_SOLID);
            assert_eq!(tree.start_solid, all.start_solid, "{name} {i}");
            hits += u32::from(all.fraction < 1.0);
            // Of two things met at once either may be told.
            apart += u32::from(tree.end.distance(all.end) > 1.0 / 32.0);
            // It ends free, if it began so.
            if !tree.start_solid && tree.fraction > 0.0 {
                let again = world.sweep(size, tree.end, tree.end, PLAYER_SOLID, &[]);
                assert!(!again.all_solid, "{name} {i}: ends in something solid");
            }
        }
        assert_eq!(apart, 0, "{name}");
        assert!(hits > 1000, "{name}: {hits} of 10000 meet anything");
    }
}

/// Ten minutes of random keys on each of ten maps: the body is never in a wall, nor out of the map.
#[test]
fn nobody_leaves_the_world() {
    const STEPS: u32 = 75_000;
    for (number, name) in MAPS.iter().enumerate() {
        let mut play = play(name);
        let mut events = Vec::new();
        let mut command = Command::default();
        let (mut farthest, start, mut deaths, mut falls) = (0f32, play.body.origin, 0, 0);
        for i in 0..STEPS {
            if i % 40 == 0 {
                let r = |d: u32| random(number, i, d);
                command = Command {
                    forward: if r(0) < 0.85 { 1.0 } else { -1.0 },
                    right: (r(1) * 3.0).floor() - 1.0,
                    up: match r(2) {
                        u if u < 0.5 => 0.0,
                        u if u < 0.9 => 1.0,
                        _ => -1.0,
                    },
                    pitch: r(3) * 60.0 - 30.0,
                    yaw: command.yaw + (r(4) - 0.5) * 180.0,
                    fast: false,
                };
            }
            events.clear();
            play.step(
                Clock::from_seconds(f64::from(i) * f64::from(STEP)),
                &command,
                &mut events,
            );
            deaths += events.iter().filter(|e| **e == Event::Died).count();
            falls += events.iter().filter(|e| **e == Event::Fell).count();
            let at = play.body.origin;
            assert!(at.is_finite() && play.body.velocity.is_finite(), "{name} step {i}");
            if i % 16 == 0 {
                let inside = play.collision.contents(at, play.placed()) & content_flags::SOLID;
                assert_eq!(inside, 0, "{name} step {i}: in solid at {at}");
            }
            farthest = farthest.max(at.distance(start));
        }
        println!("{name}: {farthest:.0} units from the spawn at most, {deaths} deaths");
        assert!(farthest > 300.0, "{name}: {farthest}");
        assert!(deaths < 400, "{name}: {deaths} deaths");
        assert_eq!(falls, 0, "{name}: out of the map");
    }
}

/// Every jump pad of the maps throws towards its target: the flight's top is there, where nothing is in between.
#[test]
fn jump_pads_throw_to_their_targets() {
    let (mut pads, mut reached) = (0, 0);
    for name in MAPS {
        let (bsp, entities) = map(name);
        for e in entities.iter().filter(|e| e.class() == "trigger_push") {
            let number: usize = e.get("model").unwrap()[1..].parse().unwrap();
            let Some(target) = entities
                .iter()
                .find(|t| t.get("targetname").is_some() && t.get("targetname") == e.get("target"))
            else {
                continue;
            };
            let m = &bsp.models[number];
            let middle = (Vec3::from(m.mins) + Vec3::from(m.maxs)) * 0.5;
            let mut play = Play::new(&bsp, &entities, &spawns(&entities));
            // Feet just inside.
            play.body.origin = Vec3::new(middle.x, middle.y, m.maxs[2] + 23.0);
            let mut nearest = f32::MAX;
            for i in 0..400 {
                play.step(
                    Clock::from_seconds(f64::from(i) * 0.008),
                    &Command::default(),
                    &mut Vec::new(),
                );
                nearest = nearest.min(play.body.origin.distance(target.origin()));
            }
            pads += 1;
            reached += u32::from(nearest < 48.0);
        }
    }
    assert!(pads >= 20, "{pads} pads");
    assert!(
        reached * 10 >= pads * 9,
        "{reached} of {pads} flights reach their target"
    );
}

#[test]
fn teleporters_put_one_at_their_destination() {
    let mut found = 0;
    for name in MAPS {
        let (bsp, entities) = map(name);
        for e in entities
            .iter()
            .filter(|e| e.class() == "trigger_teleport" && e.spawnflags() & 1 == 0)
        {
            let number: usize = e.get("model").unwrap()[1..].parse().unwrap();
            let Some(there) = entities
                .iter()
                .find(|t| t.get("targetname").is_some() && t.get("targetname") == e.get("target"))
            else {
                continue;
            };
            let m = &bsp.models[number];
            let mut play = Play::new(&bsp, &entities, &spawns(&entities));
            play.body.origin = (Vec3::from(m.mins) + Vec3::from(m.maxs)) * 0.5;
            let mut events = Vec::new();
            play.step(Clock::default(), &Command::default(), &mut events);
            assert!(events.contains(&Event::Teleported), "{name}");
            let wanted = there.number("angle").unwrap_or(0.0);
            assert!(events.contains(&Event::Turned(wanted)), "{name}: {events:?}");
            assert!(play.body.origin.distance(there.origin()) < 2.0, "{name}");
            assert!((play.body.velocity.length() - 400.0).abs() < 10.0, "{name}");
            found += 1;
        }
    }
    assert!(found >= 8, "{found}");
}

/// The sliding door of `showcase` opens for who comes, lets them through and closes behind them.
#[test]
fn doors_open_for_those_who_come() {
    let mut play = play("showcase");
    let door = play.movers[0].clone();
    let middle = play.collision.bounds(door.model).unwrap().centre();
    play.body.origin = Vec3::new(middle.x + 200.0, middle.y, 25.0);
    let go = Command {
        forward: 1.0,
        yaw: 180.0,
        ..Command::default()
    };
    let mut events = Vec::new();
    let mut highest = 0f32;
    for i in 0..250 {
        play.step(Clock::from_seconds(f64::from(i) * 0.008), &go, &mut events);
        highest = highest.max(play.movers[0].offset().z);
    }
    let at = play.body.origin;
    assert!(
        events.contains(&Event::Moved { entity: door.entity }),
        "{events:?} at {at}, door {door:?}"
    );
    assert!((highest - door.way.z).abs() < 0.1, "{highest} of {}", door.way.z);
    assert!(play.body.origin.x < middle.x - 60.0, "through: {:?}", play.body.origin);
    assert!(!play.states().is_empty());
    play.body.origin = Vec3::new(middle.x + 200.0, middle.y, 25.0);
    for i in 250..1000 {
        play.step(
            Clock::from_seconds(f64::from(i) * 0.008),
            &Command::default(),
            &mut events,
        );
    }
    assert_eq!(play.movers[0].offset(), Vec3::ZERO, "it closes");
    assert!(play.states().is_empty());
}

/// Items go when they are taken and come back.
#[test]
fn items_are_taken_and_come_back() {
    let mut play = play("oa_dm1");
    let (_, entities) = map("oa_dm1");
    let (number, health) = (0u32..)
        .zip(&entities)
        .find(|(_, e)| e.class().starts_with("item_health"))
        .unwrap();
    play.body.origin = health.origin();
    let mut events = Vec::new();
    play.step(Clock::default(), &Command::default(), &mut events);
    assert!(
        events
            .iter()
            .any(|e| matches!(e, Event::Took(class) if class.starts_with("item_health"))),
        "{events:?}"
    );
    let hidden = |play: &Play| play.states().iter().any(|s| s.entity == number && s.hidden);
    assert!(hidden(&play));
    play.body.origin += Vec3::Z * 200.0;
    play.respawn();
    for i in 0..(35.5 / STEP) as u32 {
        play.step(
            Clock::from_seconds(f64::from(i) * 0.008),
            &Command::default(),
            &mut events,
        );
    }
    assert!(!hidden(&play));
}

/// Steps through some seconds; `each` is called after every step.
fn pass(play: &mut Play, begin: f64, seconds: f32, command: &Command, mut each: impl FnMut(&mut Play, &[Event])) {
    for i in 0..(seconds / STEP) as u32 {
        let mut events = Vec::new();
        let clock = Clock::from_seconds(begin + f64::from(i) * f64::from(STEP));
        play.step(clock, command, &mut events);
        each(play, &events);
    }
}

/// Platforms wait at the bottom, carry up who steps on, stay up under them, and go down again.
#[test]
fn platforms_carry_and_come_back() {
    let mut found = 0;
    for name in ["czest2ctf", "sleekgrinder"] {
        let mut play = play(name);
        let platforms: Vec<usize> = (0..play.movers.len())
            .filter(|i| play.movers[*i].kind == Kind::Platform && play.movers[*i].field.is_some())
            .collect();
        for i in platforms {
            let platform = play.movers[i].clone();
            let bounds = play.collision.bounds(platform.model).unwrap();
            let top = Vec3::new(
                bounds.centre().x,
                bounds.centre().y,
                bounds.max.z + platform.rest.z + 24.5,
            );
            play.respawn();
            (play.body.origin, play.body.velocity) = (top, Vec3::ZERO);
            let way = platform.way.z.abs();
            let mut most = 0f32;
            pass(&mut play, 0.0, 4.0, &Command::default(), |play, _| {
                most = most.max(play.body.origin.z - top.z);
            });
            assert!((most - way).abs() < 2.0, "{name}: carried {most} of {way}");
            assert!(
                (play.movers[i].offset().z.abs() - way).abs() < 0.1,
                "it stays up under somebody"
            );
            play.respawn();
            play.body.mode = Mode::NoClip;
            pass(&mut play, 4.0, 8.0, &Command::default(), |_, _| {});
            assert_eq!(play.movers[i].offset(), Vec3::ZERO, "{name}: it goes down again");
            play.body.mode = Mode::Walk;
            found += 1;
        }
    }
    assert!(found >= 2, "{found} platforms");
}

/// Buttons set off what they name, and teams move as one.
#[test]
fn buttons_and_teams_work() {
    let (mut buttons, mut teams) = (0, 0);
    for name in ["ce1m7", "oa_bases3plus3", "oa_koth2", "kaos", "pul1duel-oa"] {
        let first = play(name);
        for i in 0..first.movers.len() {
            let mover = first.movers[i].clone();
            let Some(field) = mover.field else { continue };
            let mut play = play(name);
            play.body.origin = field.centre();
            let mut moved = Vec::new();
            let mut events = Vec::new();
            play.step(Clock::default(), &Command::default(), &mut events);
            moved.extend(events.iter().filter_map(|e| match e {
                Event::Moved { entity } => Some(*entity),
                _ => None,
            }));
            assert!(
                moved.contains(&mover.entity),
                "{name}: {mover:?} is not set off by who is there"
            );
            if mover.kind == Kind::Button && mover.target.is_some() {
                let named: Vec<_> = first
                    .movers
                    .iter()
                    .filter(|m| m.name == mover.target)
                    .map(|m| m.entity)
                    .collect();
                assert!(
                    named.iter().all(|e| moved.contains(e)),
                    "{name}: {named:?} of {moved:?}"
                );
                buttons += usize::from(!named.is_empty());
            }
            for other in first
                .movers
                .iter()
                .filter(|m| m.entity != mover.entity && m.is_team(&mover))
            {
                assert!(
                    moved.contains(&other.entity),
                    "{name}: the team of {} stays",
                    mover.entity
                );
                teams += 1;
            }
        }
    }
    assert!(buttons + teams >= 4, "{buttons} buttons, {teams} in teams");
}

/// A door turns back from somebody in its way; one that crushes does not.
#[test]
fn doors_turn_back_and_crushers_do_not() {
    for crusher in [false, true] {
        let mut play = play("showcase");
        play.movers[0].crusher = crusher;
        let door = play.movers[0].clone();
        let under = play.collision.bounds(door.model).unwrap().centre();
        play.body.origin = Vec3::new(under.x + 100.0, under.y, 24.2);
        pass(&mut play, 0.0, 1.5, &Command::default(), |_, _| {});
        assert!(play.movers[0].offset().z > 0.9 * door.way.z, "open");
        // Nobody keeps it open, and somebody is under it when it comes down.
        play.movers[0].field = None;
        play.body.origin = Vec3::new(under.x, under.y, 24.2);
        let mut died = false;
        let mut lowest = f32::MAX;
        pass(&mut play, 1.5, 4.0, &Command::default(), |play, events| {
            died |= events.contains(&Event::Died);
            lowest = lowest.min(play.movers[0].offset().z);
        });
        assert_eq!(died, crusher);
        assert_eq!(lowest <= 0.0, crusher, "{lowest}");
    }
}
