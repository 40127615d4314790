//! A device to test on, with the validation layer watching.
//!
//! `Q3RAYS_TEST_DEVICE` chooses another device (index or part of a name) than the automatic choice.

use std::sync::Arc;

use ash::vk;
use q3rays::gpu::{Buffer, Device, DeviceRequest, Instance, InstanceOptions, MemoryKind, ValidationMode};

/// Runs `test` on a fresh device; fails if the validation layer reports anything, up to and including destruction.
pub fn with_device(test: impl FnOnce(&Arc<Device>)) {
    let options = InstanceOptions {
        validation: ValidationMode::Required,
        display: None,
    };
    let instance = Instance::new(&options).expect("an instance with validation; run tests/setup.sh");
    let choice = std::env::var("Q3RAYS_TEST_DEVICE").unwrap_or_default().parse().unwrap();
    let request = DeviceRequest {
        choice,
        ..Default::default()
    };
    let device = Device::new(&instance, &request).expect("a Vulkan device; run tests/setup.sh");
    test(&device);
    assert_eq!(Arc::strong_count(&device), 1, "an object outlived its test");
    drop(device);
    let log = instance.validation_log().clone();
    assert!(instance.is_validating());
    drop(instance);
    let messages = log.messages();
    assert!(
        messages.is_empty(),
        "{} validation messages, the first: {:#?}",
        messages.len(),
        messages[0]
    );
}

/// Usage of a storage buffer.
pub fn storage() -> vk::BufferUsageFlags {
    vk::BufferUsageFlags::STORAGE_BUFFER
}

/// A storage buffer.
pub fn buffer(device: &Arc<Device>, size: u64, kind: MemoryKind) -> Buffer {
    Buffer::new(device, "test buffer", size, storage(), kind).unwrap()
}
