//! The Vulkan layer on whatever device there is, with the validation layer watching.

mod gpu_fixture;

use std::sync::Arc;

use ash::vk;
use q3rays::gpu::shader_table::load_spirv;
use q3rays::gpu::{
    Access, AdoptedHandles, Binding, BindingKind, Buffer, ComputePipeline, ComputePipelineDesc, DescriptorLayout,
    DescriptorSets, Device, DeviceRequest, FrameRing, GpuError, Image, ImageDesc, Instance, InstanceOptions,
    MemoryKind, PipelineCache, SampledTexture, Sampler, SamplerDesc, SubmitSync, Timestamps, Tracker, UploadBatch, Use,
    ValidationMode, Write,
};

use gpu_fixture::{buffer, storage, with_device};

#[test]
fn the_report_names_devices_and_what_they_lack() {
    with_device(|device| {
        let reports = device.instance().devices().unwrap();
        assert!(!reports.is_empty());
        for report in &reports {
            assert_eq!(report.supports_rayquery(), report.missing_for_rayquery.is_empty());
            let text = report.to_string();
            assert!(
                text.contains(&report.name) && text.contains("bvh") && text.contains("rayquery"),
                "{text}"
            );
        }
        let wanted = DeviceRequest {
            choice: "no such device".parse().unwrap(),
            ..Default::default()
        };
        assert!(matches!(
            Device::new(device.instance(), &wanted),
            Err(GpuError::NoSuchDevice { .. })
        ));
        assert!(device.limits().max_work_group_invocations >= 128);
        assert!(!device.info().driver.is_empty());
    });
}

#[test]
fn buffers_round_trip_in_pieces_larger_than_the_staging_memory() {
    with_device(|device| {
        let large: Vec<u32> = (0..1_000_003).map(|i: u32| i.wrapping_mul(2_654_435_761)).collect();
        let small = [1u8, 2, 3, 4, 5];
        let target = buffer(device, size_of_val(&large[..]) as u64, MemoryKind::DeviceLocal);
        let other = buffer(device, 64, MemoryKind::DeviceLocal);
        let mut batch = UploadBatch::new(device, 0).unwrap();
        batch.buffer(&other, 8, &small).unwrap();
        batch.buffer(&target, 0, &large).unwrap();
        batch.buffer(&other, 32, &small).unwrap();
        assert!(matches!(
            batch.buffer(&other, 60, &small),
            Err(GpuError::InvalidInput(_))
        ));
        batch.finish().unwrap();

        let readback = buffer(device, target.size(), MemoryKind::Readback);
        let readback_other = buffer(device, other.size(), MemoryKind::Readback);
        device
            .submit_once("readback", |cmd| {
                cmd.copy_buffer(&target, 0, &readback, 0, target.size())?;
                cmd.copy_buffer(&other, 0, &readback_other, 0, other.size())?;
                assert!(cmd.copy_buffer(&other, 0, &readback_other, 1, other.size()).is_err());
                Ok(())
            })
            .unwrap();
        assert_eq!(readback.read::<u32>().unwrap(), large);
        let bytes = readback_other.read::<u8>().unwrap();
        assert_eq!((&bytes[8..13], &bytes[32..37]), (&small[..], &small[..]));
    });
}

#[test]
fn empty_and_misused_buffers_are_no_crash() {
    with_device(|device| {
        let empty = buffer(device, 0, MemoryKind::Upload);
        assert_eq!((empty.size(), empty.read::<u32>().unwrap().len()), (0, 0));
        assert_ne!(empty.address(), 0);
        let mut local = buffer(device, 16, MemoryKind::Upload);
        assert!(local.write(8, &[1u32, 2, 3]).is_err());
        assert!(local.write(u64::MAX, &[1u8]).is_err());
        let huge = Buffer::new(device, "huge", 1 << 60, storage(), MemoryKind::DeviceLocal);
        assert!(huge.is_err());
    });
}

#[test]
fn image_levels_round_trip() {
    with_device(|device| {
        let desc = ImageDesc {
            name: "test image",
            format: vk::Format::R8G8B8A8_UNORM,
            width: 301,
            height: 200,
            mips: 0,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::STORAGE,
        };
        let image = Image::new(device, &desc).unwrap();
        assert_eq!(image.mips(), 9);
        let levels: Vec<Vec<u8>> = (0..image.mips())
            .map(|mip| {
                (0..image.mip_bytes(mip).unwrap())
                    .map(|i| (i * 7 + u64::from(mip) * 13) as u8)
                    .collect()
            })
            .collect();
        // Level 0 is larger than the staging memory, so it goes in several pieces.
        let mut batch = UploadBatch::new(device, 0).unwrap();
        for (mip, level) in (0..).zip(&levels) {
            batch.image(&image, mip, level).unwrap();
        }
        assert!(batch.image(&image, 0, &[0; 3]).is_err());
        assert!(batch.image(&image, 99, &[]).is_err());
        batch.finish().unwrap();
        for (mip, level) in (0..).zip(&levels) {
            assert!(image.read_back(mip).unwrap() == *level, "level {mip} differs");
        }
        for bad in [ImageDesc { width: 0, ..desc }, ImageDesc { width: 1 << 30, ..desc }] {
            assert!(Image::new(device, &bad).is_err());
        }
        let compressed_storage = ImageDesc {
            format: vk::Format::ASTC_4X4_SRGB_BLOCK,
            ..desc
        };
        assert!(matches!(
            Image::new(device, &compressed_storage),
            Err(GpuError::Unsupported(_))
        ));
    });
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|bytes| f32::from_le_bytes(*bytes))
        .collect()
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct FillPush {
    target: u64,
    count: u32,
    pad: u32,
}

fn fill_pipeline(device: &Arc<Device>, name: &str, cache: Option<&PipelineCache>) -> ComputePipeline {
    let spirv = load_spirv(name).unwrap();
    let desc = ComputePipelineDesc {
        name,
        spirv: &spirv,
        layouts: &[],
        push_constant_bytes: size_of::<FillPush>() as u32,
        specialization: &[(0, 64), (1, 1000)],
        cache,
    };
    ComputePipeline::new(device, &desc).unwrap()
}

#[test]
fn compute_writes_through_an_address_in_overlapping_frames() {
    with_device(|device| {
        const COUNT: u32 = 10_000;
        let pipeline = fill_pipeline(device, "test_fill", None);
        let squares = fill_pipeline(device, "test_fill_squares", None);
        let target = buffer(device, u64::from(COUNT) * 4, MemoryKind::DeviceLocal);
        let readback = buffer(device, u64::from(COUNT) * 4, MemoryKind::Readback);
        let mut ring = FrameRing::new(device, 2, 8).unwrap();
        let mut tracker = Tracker::new();
        let mut timed = 0;
        for index in 0..6 {
            let frame = ring.begin().unwrap();
            assert_eq!((frame.index(), frame.slot()), (index, index as usize % 2));
            if let Some(timings) = frame.timings() {
                assert_eq!(timings.frame, index - 2);
                let names: Vec<_> = timings.scopes.iter().map(|scope| scope.name.as_ref()).collect();
                assert_eq!(names, ["fill", "copy"]);
                assert!(timings.scopes.iter().all(|scope| scope.milliseconds >= 0.0));
                timed += 1;
            }
            let push = FillPush {
                target: target.address(),
                count: COUNT,
                pad: 0,
            };
            let cmd = frame.commands();
            let chosen = if index % 2 == 0 { &pipeline } else { &squares };
            frame.timestamps().scope(&cmd, "fill", |cmd| {
                tracker
                    .pass(cmd, &[Use::buffer(&target, Access::ComputeWrite)])
                    .unwrap();
                chosen.bind(cmd, &[]).unwrap();
                chosen.push(cmd, &push).unwrap();
                chosen.dispatch(cmd, [COUNT.div_ceil(64), 1, 1]).unwrap();
            });
            frame.timestamps().scope(&cmd, "copy", |cmd| {
                let uses = [
                    Use::buffer(&target, Access::TransferRead),
                    Use::buffer(&readback, Access::TransferWrite),
                ];
                tracker.pass(cmd, &uses).unwrap();
                cmd.copy_buffer(&target, 0, &readback, 0, target.size()).unwrap();
            });
            tracker.pass(&cmd, &[Use::buffer(&readback, Access::HostRead)]).unwrap();
            // An object that is dropped here would be in use; retired, it lives until the frame is done.
            let short_lived = buffer(device, 256, MemoryKind::DeviceLocal);
            cmd.fill_buffer(&short_lived, 7);
            frame.retire(short_lived);
            frame.submit(SubmitSync::default()).unwrap();
        }
        // An abandoned frame leaves the ring usable.
        drop(ring.begin().unwrap());
        ring.wait().unwrap();
        let expected: Vec<u32> = (0..COUNT).map(|i| 1000u32.wrapping_add(i.wrapping_mul(i))).collect();
        assert_eq!(readback.read::<u32>().unwrap(), expected, "frame 5 wrote squares");
        if device.limits().timestamp_valid_bits > 0 {
            assert_eq!(timed, 4);
        }
        assert!(pipeline_rejects_bad_input(device));
    });
}

fn pipeline_rejects_bad_input(device: &Arc<Device>) -> bool {
    let desc = ComputePipelineDesc {
        name: "bad",
        spirv: &[1, 2, 3],
        layouts: &[],
        push_constant_bytes: 0,
        specialization: &[],
        cache: None,
    };
    matches!(ComputePipeline::new(device, &desc), Err(GpuError::Shader { .. }))
}

#[test]
fn textures_are_found_by_index_and_written_to_storage_images() {
    with_device(|device| {
        let sampled = ImageDesc {
            name: "texture",
            format: vk::Format::R8G8B8A8_UNORM,
            width: 4,
            height: 4,
            mips: 2,
            usage: vk::ImageUsageFlags::SAMPLED,
        };
        let textures: Vec<Image> = (0..3).map(|_| Image::new(device, &sampled).unwrap()).collect();
        let mut batch = UploadBatch::new(device, 1 << 20).unwrap();
        for (shade, texture) in (1u8..).zip(&textures) {
            batch.image(texture, 0, &[shade * 50; 4 * 4 * 4]).unwrap();
            batch.image(texture, 1, &[shade * 50 + 5; 2 * 2 * 4]).unwrap();
        }
        batch.finish().unwrap();
        let target = Image::new(
            device,
            &ImageDesc {
                name: "target",
                format: vk::Format::R32G32B32A32_SFLOAT,
                width: 20,
                height: 10,
                mips: 1,
                usage: vk::ImageUsageFlags::STORAGE,
            },
        )
        .unwrap();
        let sampler = Sampler::new(
            device,
            "sampler",
            &SamplerDesc {
                anisotropy: 8.0,
                ..Default::default()
            },
        )
        .unwrap();
        let bindings = [
            Binding::one(0, BindingKind::StorageImage),
            Binding::variable(1, BindingKind::Texture, 1024),
        ];
        let layout = DescriptorLayout::new(device, "test layout", &bindings).unwrap();
        let sets = DescriptorSets::new(&layout, 2, 5).unwrap();
        let elements: Vec<_> = textures
            .iter()
            .map(|image| SampledTexture {
                image,
                sampler: &sampler,
            })
            .collect();
        let writes = [Write::storage_image(0, &target), Write::textures(1, 0, &elements)];
        sets.write(0, &writes).unwrap();
        sets.write(1, &writes).unwrap();
        assert!(
            sets.write(0, &[Write::textures(1, 3, &elements)]).is_err(),
            "beyond the end"
        );
        assert!(
            sets.write(0, &[Write::textures(0, 0, &elements)]).is_err(),
            "of another kind"
        );
        assert!(sets.write(0, &[Write::storage_image(9, &target)]).is_err(), "not there");
        let spirv = load_spirv("test_image").unwrap();
        let desc = ComputePipelineDesc {
            name: "test_image",
            spirv: &spirv,
            layouts: &[&layout],
            push_constant_bytes: 8,
            specialization: &[],
            cache: None,
        };
        let pipeline = ComputePipeline::new(device, &desc).unwrap();
        let mut tracker = Tracker::new();
        for (index, lod, expected) in [(0u32, 0.0f32, 50.0), (2, 0.0, 150.0), (1, 1.0, 105.0)] {
            device
                .submit_once("sample", |cmd| {
                    tracker.pass(cmd, &[Use::image(&target, Access::ComputeWrite)])?;
                    pipeline.bind(cmd, &[sets.raw(index as usize)])?;
                    pipeline.push(cmd, &[index, lod.to_bits()])?;
                    pipeline.dispatch(cmd, [3, 2, 1])
                })
                .unwrap();
            let texels: Vec<f32> = floats(&target.read_back(0).unwrap());
            assert!(
                texels.iter().all(|value| (value * 255.0 - expected).abs() < 0.01),
                "{:?}",
                &texels[..4]
            );
        }
    });
}

#[test]
fn the_pipeline_cache_survives_damage() {
    with_device(|device| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipelines.bin");
        let cache = PipelineCache::load(device, Some(&path)).unwrap();
        fill_pipeline(device, "test_fill", Some(&cache));
        cache.save(&path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        fill_pipeline(
            device,
            "test_fill",
            Some(&PipelineCache::load(device, Some(&path)).unwrap()),
        );
        for damaged in [&whole[..whole.len() / 2], b"nonsense", b""] {
            std::fs::write(&path, damaged).unwrap();
            fill_pipeline(
                device,
                "test_fill",
                Some(&PipelineCache::load(device, Some(&path)).unwrap()),
            );
        }
        assert!(matches!(
            cache.save(&folder.path().join("no/such/folder")),
            Err(GpuError::Io { .. })
        ));
    });
}

#[test]
fn timestamps_measure_one_shot_work() {
    with_device(|device| {
        let timestamps = Timestamps::new(device, 2).unwrap();
        let target = buffer(device, 8 << 20, MemoryKind::DeviceLocal);
        device
            .submit_once("timed", |cmd| {
                timestamps.reset(cmd);
                let outer = timestamps.begin(cmd, "outer");
                timestamps.scope(cmd, "fill", |cmd| cmd.fill_buffer(&target, 1));
                timestamps.scope(cmd, "one too many", |_| ());
                timestamps.end(cmd, outer);
                Ok(())
            })
            .unwrap();
        match timestamps.read().unwrap() {
            Some(times) => {
                assert_eq!(
                    times.iter().map(|time| time.name.as_ref()).collect::<Vec<_>>(),
                    ["outer", "fill"]
                );
                assert!(times[0].milliseconds >= times[1].milliseconds && times[1].milliseconds > 0.0);
            }
            None => assert_eq!(device.limits().timestamp_valid_bits, 0),
        }
    });
}

#[test]
fn an_adopted_device_works_and_stays_alive() {
    with_device(|device| {
        let owner = device.instance();
        // SAFETY: the handles belong together and outlive this scope.
        let instance = unsafe { Instance::adopt(owner.entry().clone(), owner.raw().clone(), true, false) };
        let handles = AdoptedHandles {
            instance,
            physical_device: device.physical(),
            device: device.raw().clone(),
            queue: Arc::new(std::sync::Mutex::new(*device.queue())),
            queue_family: device.queue_family(),
            enabled: device.info().enabled,
            swapchain: false,
        };
        // SAFETY: as above; the queue is not used from elsewhere meanwhile.
        let adopted = unsafe { Device::adopt(handles) }.unwrap();
        let target = buffer(&adopted, 64, MemoryKind::Readback);
        adopted
            .submit_once("fill", |cmd| {
                cmd.fill_buffer(&target, 42);
                Ok(())
            })
            .unwrap();
        assert_eq!(target.read::<u32>().unwrap(), [42; 16]);
        drop((target, adopted));
        device.wait_idle().unwrap();
    });
}

#[test]
fn the_validation_layer_is_listening() {
    let options = InstanceOptions {
        validation: ValidationMode::Required,
        display: None,
    };
    let instance = Instance::new(&options).unwrap();
    let device = Device::new(&instance, &DeviceRequest::default()).unwrap();
    let target = buffer(&device, 64, MemoryKind::DeviceLocal);
    // The second fill does not wait for the first.
    device
        .submit_once("hazard", |cmd| {
            cmd.fill_buffer(&target, 1);
            cmd.fill_buffer(&target, 2);
            Ok(())
        })
        .unwrap();
    let messages = instance.validation_log().messages();
    assert!(
        messages
            .iter()
            .any(|message| message.is_error && message.id.contains("SYNC")),
        "{messages:?}"
    );
}

/// Not a test by itself: run by the next one in a process that sees no Vulkan driver.
#[test]
#[ignore = "needs an environment without a Vulkan driver"]
fn without_a_driver() {
    let result = Instance::new(&InstanceOptions::default());
    let error = result
        .and_then(|instance| Device::new(&instance, &DeviceRequest::default()))
        .err()
        .unwrap();
    assert!(matches!(error, GpuError::NoDevice), "{error}");
}

#[test]
fn a_machine_without_a_driver_is_told_so() {
    let child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "without_a_driver"])
        .envs([("VK_DRIVER_FILES", "none"), ("VK_ICD_FILENAMES", "none")])
        .output()
        .unwrap();
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
    assert!(String::from_utf8_lossy(&child.stdout).contains("1 passed"));
}
