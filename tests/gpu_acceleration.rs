//! Acceleration structures and ray queries, on a device that has them.

mod gpu_fixture;

use std::sync::Arc;

use ash::vk;
use gpu_fixture::{buffer, with_device};
use q3rays::gpu::acceleration::{
    BottomDesc, BottomLevel, BuildPreference, Refit, Scratch, TopInstance, TopLevel, TriangleGeometry,
};
use q3rays::gpu::shader_table::load_spirv;
use q3rays::gpu::{
    Access, Binding, BindingKind, Buffer, ComputePipeline, ComputePipelineDesc, DescriptorLayout, DescriptorSets,
    Device, FrameRing, GpuError, MemoryKind, SubmitSync, Tracker, Use, Write,
};

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Ray {
    origin: [f32; 3],
    t_min: f32,
    direction: [f32; 3],
    t_max: f32,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    rays: u64,
    hits: u64,
    count: u32,
    mask: u32,
}

/// Where a ray hit: instance custom index, geometry, primitive, distance.
type Hit = Option<(u32, u32, u32, f32)>;

/// A ray straight down from height 10.
fn down(x: f32, y: f32) -> Ray {
    Ray {
        origin: [x, y, 10.0],
        t_min: 0.0,
        direction: [0.0, 0.0, -1.0],
        t_max: 1000.0,
    }
}

fn input(device: &Arc<Device>, data: &[impl bytemuck::NoUninit]) -> Buffer {
    let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
    Buffer::with_data(device, "build input", data, usage).unwrap()
}

/// `n` by `n` unit squares of two triangles each at height `z`, from x = y = 0 on.
fn grid(n: u32, z: f32) -> (Vec<[f32; 3]>, Vec<u32>) {
    let side = n + 1;
    let positions = (0..side * side)
        .map(|i| [(i % side) as f32, (i / side) as f32, z])
        .collect();
    let square = |i: u32| {
        let corner = i / n * side + i % n;
        [
            corner,
            corner + 1,
            corner + side,
            corner + 1,
            corner + side + 1,
            corner + side,
        ]
    };
    (positions, (0..n * n).flat_map(square).collect())
}

fn geometry(positions: &Buffer, indices: &Buffer, opaque: bool) -> TriangleGeometry {
    TriangleGeometry {
        vertices: positions.address(),
        vertex_stride: 12,
        vertex_count: (positions.size() / 12) as u32,
        indices: indices.address(),
        triangle_count: (indices.size() / 12) as u32,
        opaque,
    }
}

/// The pipeline that traces, and what it needs.
struct Tracer {
    pipeline: ComputePipeline,
    sets: DescriptorSets,
    rays: Buffer,
    hits: Buffer,
}

impl Tracer {
    fn new(device: &Arc<Device>, rays: &[Ray], frames: u32) -> Self {
        let bindings = [Binding::one(0, BindingKind::AccelerationStructure)];
        let layout = DescriptorLayout::new(device, "rays", &bindings).unwrap();
        let spirv = load_spirv("test_ray_query").unwrap();
        let desc = ComputePipelineDesc {
            name: "test_ray_query",
            spirv: &spirv,
            layouts: &[&layout],
            push_constant_bytes: size_of::<Push>() as u32,
            specialization: &[],
            cache: None,
        };
        Self {
            pipeline: ComputePipeline::new(device, &desc).unwrap(),
            sets: DescriptorSets::new(&layout, frames, 0).unwrap(),
            rays: Buffer::with_data(device, "rays", rays, gpu_fixture::storage()).unwrap(),
            hits: buffer(device, rays.len() as u64 * 16, MemoryKind::Readback),
        }
    }

    /// Builds `top` over `instances` and traces all rays in one frame.
    fn record(
        &self,
        ring: &mut FrameRing,
        tracker: &mut Tracker,
        top: &mut TopLevel,
        instances: &[TopInstance],
        mask: u32,
    ) {
        let frame = ring.begin().unwrap();
        let cmd = frame.commands();
        tracker
            .pass(&cmd, &[Use::resource(top.id(), Access::BuildWrite)])
            .unwrap();
        top.record_build(&cmd, instances, frame.slot()).unwrap();
        self.sets
            .write(frame.slot(), &[Write::acceleration_structure(0, top)])
            .unwrap();
        let uses = [
            Use::resource(top.id(), Access::Trace),
            Use::buffer(&self.hits, Access::ComputeWrite),
        ];
        tracker.pass(&cmd, &uses).unwrap();
        let count = (self.rays.size() / size_of::<Ray>() as u64) as u32;
        let push = Push {
            rays: self.rays.address(),
            hits: self.hits.address(),
            count,
            mask,
        };
        self.pipeline.bind(&cmd, &[self.sets.raw(frame.slot())]).unwrap();
        self.pipeline.push(&cmd, &push).unwrap();
        self.pipeline.dispatch(&cmd, [count.div_ceil(32), 1, 1]).unwrap();
        tracker
            .pass(&cmd, &[Use::buffer(&self.hits, Access::HostRead)])
            .unwrap();
        frame.submit(SubmitSync::default()).unwrap();
    }

    fn results(&self) -> Vec<Hit> {
        let hits = self.hits.read::<[u32; 4]>().unwrap();
        hits.iter()
            .map(|&[instance, geometry, primitive, t]| {
                (instance != u32::MAX).then(|| (instance, geometry, primitive, f32::from_bits(t)))
            })
            .collect()
    }
}

/// Runs `test` on a device that can trace rays; one that cannot is a failure of the set-up.
fn with_ray_query(test: impl FnOnce(&Arc<Device>)) {
    with_device(|device| {
        assert!(
            device.has_ray_query(),
            "{} has no ray query: run tests/setup.sh, which installs a lavapipe that has it",
            device.info().name
        );
        test(device);
    });
}

#[test]
fn rays_hit_the_right_triangles_of_compacted_structures() {
    with_ray_query(|device| {
        let (positions, indices) = grid(40, 0.0);
        let (high, high_indices) = grid(2, 3.0);
        let buffers = [input(device, &positions), input(device, &indices)];
        let high_buffers = [input(device, &high), input(device, &high_indices)];
        let floor = geometry(&buffers[0], &buffers[1], true);
        let table = geometry(&high_buffers[0], &high_buffers[1], false);
        let desc = BottomDesc {
            name: "room",
            geometries: &[floor, table],
            preference: BuildPreference::FastTrace,
            allow_update: false,
            compact: true,
        };
        let alone = BottomDesc {
            name: "floor",
            geometries: &[floor],
            ..desc
        };
        let empty = BottomDesc {
            name: "empty",
            geometries: &[],
            ..desc
        };
        let (levels, statistics) = BottomLevel::build(device, &[desc, alone, empty]).unwrap();
        assert_eq!((statistics.structures, statistics.triangles), (3, 3200 + 8 + 3200));
        assert!(statistics.bytes_final <= statistics.bytes_built && statistics.bytes_final > 0);
        assert!(statistics.milliseconds > 0.0);
        println!("{statistics:?}");

        let rays = [
            down(0.25, 0.25),
            down(10.25, 20.25),
            down(10.75, 20.75),
            down(-0.5, 5.0),
            down(100.25, 0.25),
        ];
        let tracer = Tracer::new(device, &rays, 2);
        let mut ring = FrameRing::new(device, 2, 4).unwrap();
        let mut tracker = Tracker::new();
        let mut top = TopLevel::new(device, "scene", 1, 2).unwrap();

        let room = TopInstance::new(&levels[0], 7);
        tracer.record(&mut ring, &mut tracker, &mut top, &[room], 0xff);
        ring.wait().unwrap();
        let square = (20 * 40 + 10) * 2;
        let expected = [
            Some((7, 1, 0, 7.0)),
            Some((7, 0, square, 10.0)),
            Some((7, 0, square + 1, 10.0)),
            None,
            None,
        ];
        assert_eq!(tracer.results(), expected);

        // More instances than there is room for: another handle; one is moved, one is masked out, one is empty.
        let mut moved = TopInstance {
            mask: 2,
            ..TopInstance::new(&levels[1], 0xff_ffff)
        };
        moved.transform[0][3] = 100.0;
        let masked = TopInstance {
            mask: 4,
            ..TopInstance::new(&levels[1], 5)
        };
        let nothing = TopInstance::new(&levels[2], 6);
        let before = top.raw();
        tracer.record(&mut ring, &mut tracker, &mut top, &[room, moved, masked, nothing], 3);
        assert_ne!(top.raw(), before);
        ring.wait().unwrap();
        assert_eq!(tracer.results()[..4], expected[..4]);
        assert_eq!(tracer.results()[4], Some((0xff_ffff, 0, 0, 10.0)));

        // Frames overlap, handles stay; at last nothing is there at all.
        let before = top.raw();
        for _ in 0..3 {
            tracer.record(&mut ring, &mut tracker, &mut top, &[room, moved], 0xff);
        }
        tracer.record(&mut ring, &mut tracker, &mut top, &[], 0xff);
        assert_eq!(top.raw(), before);
        ring.wait().unwrap();
        assert_eq!(tracer.results(), [None; 5]);

        let too_large = TopInstance::new(&levels[0], 1 << 24);
        let result = device.submit_once("bad", |cmd| top.record_build(cmd, &[too_large], 0));
        assert!(matches!(result, Err(GpuError::InvalidInput(_))));
    });
}

#[test]
fn refits_follow_the_vertices() {
    with_ray_query(|device| {
        let (positions, indices) = grid(4, 0.0);
        let mut vertices = input(device, &positions);
        let indices = input(device, &indices);
        let geometries = [geometry(&vertices, &indices, true)];
        let desc = BottomDesc {
            name: "cloth",
            geometries: &geometries,
            preference: BuildPreference::FastBuild,
            allow_update: true,
            compact: false,
        };
        let fixed = BottomDesc {
            name: "fixed",
            allow_update: false,
            compact: true,
            ..desc
        };
        let (levels, _) = BottomLevel::build(device, &[desc, fixed]).unwrap();
        let tracer = Tracer::new(device, &[down(1.25, 1.25)], 1);
        let mut ring = FrameRing::new(device, 1, 0).unwrap();
        let mut tracker = Tracker::new();
        let mut top = TopLevel::new(device, "scene", 1, 1).unwrap();
        for (height, rebuild) in [(2.0f32, false), (5.0, true), (-1.0, false)] {
            let moved: Vec<_> = positions.iter().map(|p| [p[0], p[1], height]).collect();
            vertices.write(0, &moved).unwrap();
            let refit = [Refit {
                bottom: &levels[0],
                geometries: &geometries,
                rebuild,
            }];
            let scratch = Scratch::new(device, BottomLevel::refit_scratch_bytes(device, &refit)).unwrap();
            device
                .submit_once("refit", |cmd| {
                    tracker.pass(cmd, &[Use::resource(levels[0].id(), Access::BuildWrite)])?;
                    BottomLevel::record_refits(cmd, &refit, &scratch)
                })
                .unwrap();
            tracer.record(
                &mut ring,
                &mut tracker,
                &mut top,
                &[TopInstance::new(&levels[0], 1)],
                0xff,
            );
            ring.wait().unwrap();
            assert_eq!(tracer.results(), [Some((1, 0, 10, 10.0 - height))]);
        }
        let scratch = Scratch::new(device, 1 << 20).unwrap();
        let fewer = [TriangleGeometry {
            triangle_count: 1,
            ..geometries[0]
        }];
        let bad = [
            Refit {
                bottom: &levels[1],
                geometries: &geometries,
                rebuild: false,
            },
            Refit {
                bottom: &levels[0],
                geometries: &fewer,
                rebuild: false,
            },
            Refit {
                bottom: &levels[0],
                geometries: &[],
                rebuild: true,
            },
        ];
        for refit in bad {
            let result = device.submit_once("bad refit", |cmd| BottomLevel::record_refits(cmd, &[refit], &scratch));
            assert!(matches!(result, Err(GpuError::InvalidInput(_))));
        }
        let no_vertices = [TriangleGeometry {
            vertex_count: 0,
            ..geometries[0]
        }];
        let desc = BottomDesc {
            geometries: &no_vertices,
            ..desc
        };
        assert!(matches!(
            BottomLevel::build(device, &[desc]),
            Err(GpuError::InvalidInput(_))
        ));
    });
}
