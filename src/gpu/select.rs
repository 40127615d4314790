//! Which of the machine's Vulkan devices to use.

use std::convert::Infallible;
use std::str::FromStr;

use ash::vk;

use super::{DeviceReport, GpuError, Surface};

/// The user's choice of device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The best that can do what is asked: discrete before integrated before virtual before CPU.
    #[default]
    Auto,
    /// Position in the list of devices.
    Index(usize),
    /// Part of the device's name, upper and lower case alike.
    Name(String),
}

impl FromStr for DeviceChoice {
    type Err = Infallible;

    /// Digits are an index, "auto" and the empty string choose automatically, anything else is part of a name.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        let text = text.trim();
        Ok(match text.parse() {
            Ok(index) => Self::Index(index),
            Err(_) if text.is_empty() || text.eq_ignore_ascii_case("auto") => Self::Auto,
            Err(_) => Self::Name(text.to_owned()),
        })
    }
}

/// Whether ray queries are to be enabled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayQueryUse {
    /// Leave them off.
    Never,
    /// Enable them on a device that has them.
    #[default]
    IfAvailable,
    /// Only a device that has them will do.
    Required,
}

/// What [`super::Device::new`] is asked for.
#[derive(Clone, Default)]
pub struct DeviceRequest<'a> {
    /// Which device.
    pub choice: DeviceChoice,
    /// Ray queries wanted?
    pub ray_query: RayQueryUse,
    /// The surface to present to; `None` for headless use.
    pub surface: Option<&'a Surface>,
}

/// Picks a device from `reports`. `can_present` tells whether a device can present to the surface asked for.
pub(super) fn select<'r>(
    reports: &'r [DeviceReport],
    choice: &DeviceChoice,
    ray_query: RayQueryUse,
    can_present: impl Fn(&DeviceReport) -> bool,
) -> Result<&'r DeviceReport, GpuError> {
    let missing = |report: &DeviceReport| -> Vec<String> {
        let mut missing = match ray_query {
            RayQueryUse::Required => report.missing_for_rayquery.clone(),
            RayQueryUse::Never | RayQueryUse::IfAvailable => report.missing_for_bvh.clone(),
        };
        if !can_present(report) {
            missing.push("presentation to this window".into());
        }
        missing
    };
    if reports.is_empty() {
        return Err(GpuError::NoDevice);
    }
    let candidates: Vec<&DeviceReport> = match choice {
        DeviceChoice::Auto => reports.iter().collect(),
        DeviceChoice::Index(index) => reports.get(*index).into_iter().collect(),
        DeviceChoice::Name(part) => {
            let part = part.to_lowercase();
            reports
                .iter()
                .filter(|report| report.name.to_lowercase().contains(&part))
                .collect()
        }
    };
    let usable = candidates.iter().filter(|report| missing(report).is_empty());
    // `min_by_key` keeps the first of equals, so Vulkan's own order breaks ties.
    if let Some(best) = usable.min_by_key(|report| rank(report.device_type)) {
        return Ok(best);
    }
    match candidates.iter().min_by_key(|report| missing(report).len()) {
        Some(nearest) => Err(GpuError::MissingFeature {
            device: format!("the Vulkan device '{}'", nearest.name),
            missing: missing(nearest).join(", "),
        }),
        None => Err(GpuError::NoSuchDevice {
            wanted: match choice {
                DeviceChoice::Index(index) => index.to_string(),
                DeviceChoice::Name(name) => name.clone(),
                DeviceChoice::Auto => "auto".into(),
            },
            available: reports
                .iter()
                .map(|r| format!("{} ({})", r.index, r.name))
                .collect::<Vec<_>>()
                .join(", "),
        }),
    }
}

fn rank(device_type: vk::PhysicalDeviceType) -> u32 {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 3,
        _ => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(index: usize, name: &str, device_type: vk::PhysicalDeviceType, rays: bool) -> DeviceReport {
        DeviceReport {
            index,
            name: name.into(),
            driver: String::new(),
            device_type,
            api_version: "1.2.0".into(),
            missing_for_bvh: Vec::new(),
            missing_for_rayquery: if rays {
                Vec::new()
            } else {
                vec!["VK_KHR_ray_query".into()]
            },
            optional: Default::default(),
            raw: vk::PhysicalDevice::null(),
            extensions: Vec::new(),
        }
    }

    fn machine() -> Vec<DeviceReport> {
        vec![
            report(0, "llvmpipe", vk::PhysicalDeviceType::CPU, true),
            report(1, "Small GPU", vk::PhysicalDeviceType::INTEGRATED_GPU, false),
            report(2, "Big GPU", vk::PhysicalDeviceType::DISCRETE_GPU, false),
        ]
    }

    fn index(choice: &str, ray_query: RayQueryUse) -> Result<usize, GpuError> {
        let choice = choice.parse().unwrap();
        select(&machine(), &choice, ray_query, |_| true).map(|report| report.index)
    }

    #[test]
    fn automatic_choice_prefers_discrete_then_what_is_required() {
        assert_eq!(index("auto", RayQueryUse::IfAvailable).unwrap(), 2);
        assert_eq!(index("auto", RayQueryUse::Required).unwrap(), 0);
    }

    #[test]
    fn index_and_part_of_name() {
        assert_eq!(index("1", RayQueryUse::Never).unwrap(), 1);
        assert_eq!(index("BIG", RayQueryUse::Never).unwrap(), 2);
        assert!(matches!(
            index("7", RayQueryUse::Never),
            Err(GpuError::NoSuchDevice { .. })
        ));
        assert!(matches!(
            index("voodoo", RayQueryUse::Never),
            Err(GpuError::NoSuchDevice { .. })
        ));
    }

    #[test]
    fn what_is_missing_is_named() {
        let error = index("big", RayQueryUse::Required).unwrap_err().to_string();
        assert!(
            error.contains("Big GPU") && error.contains("VK_KHR_ray_query"),
            "{error}"
        );
        assert!(matches!(
            select(&[], &DeviceChoice::Auto, RayQueryUse::Never, |_| true),
            Err(GpuError::NoDevice)
        ));
    }
}
