//! Collects what the Vulkan validation layers report, so that tests can assert that they report nothing.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

/// Name of the layer that checks our use of Vulkan.
pub(super) const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Whether to load the validation layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ValidationMode {
    /// Never.
    #[default]
    Off,
    /// If it is installed.
    IfAvailable,
    /// Creation of the instance fails when it is not installed. Also checks synchronisation.
    Required,
}

/// A message that is known and harmless.
struct Allowed {
    /// The message's identifier, as the layer names it.
    id: &'static str,
    /// A part of its text that must be present too.
    contains: &'static str,
    /// Why it is harmless.
    reason: &'static str,
}

/// Messages that do not count, each with its reason.
const ALLOWED: &[Allowed] = &[];

/// One warning or error of the validation layer.
#[derive(Clone, Debug)]
pub struct ValidationMessage {
    /// Error, as against warning.
    pub is_error: bool,
    /// The layer's identifier of the rule, e.g. a VUID.
    pub id: String,
    /// The full text.
    pub text: String,
}

/// The warnings and errors collected so far; shared between the messenger and whoever wants to look.
#[derive(Debug, Default)]
pub struct ValidationLog {
    messages: Mutex<Vec<ValidationMessage>>,
}

impl ValidationLog {
    /// A copy of all messages so far that are not on the allow-list.
    pub fn messages(&self) -> Vec<ValidationMessage> {
        self.messages.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn push(&self, message: ValidationMessage) {
        self.messages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(message);
    }
}

/// The description of a messenger that writes to `log`. `log` must outlive the messenger and the instance.
pub(super) fn messenger_info(log: &Arc<ValidationLog>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
                | vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
        )
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(log).cast_mut().cast())
}

/// Vulkan's callback; called from any thread that calls Vulkan.
///
/// # Safety
/// Called by Vulkan with `user_data` set by [`messenger_info`].
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid pointers for the duration of the call; the log outlives the instance.
    let (Some(data), Some(log)) = (unsafe { data.as_ref() }, unsafe {
        user_data.cast::<ValidationLog>().as_ref()
    }) else {
        return vk::FALSE;
    };
    // SAFETY: both strings are null or null-terminated and live as long as `data`.
    let (id, text) = unsafe { (data.message_id_name_as_c_str(), data.message_as_c_str()) };
    let id = id.map(CStr::to_string_lossy).unwrap_or_default();
    let text = text.map(CStr::to_string_lossy).unwrap_or_default();
    let is_error = severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR);
    // Loader and driver chatter ("general") says nothing about our use of Vulkan.
    if !kind.intersects(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
    {
        tracing::debug!(id = %id, "{text}");
        return vk::FALSE;
    }
    if let Some(allowed) = ALLOWED
        .iter()
        .find(|allowed| allowed.id == id && text.contains(allowed.contains))
    {
        tracing::debug!(id = %id, reason = allowed.reason, "allowed: {text}");
        return vk::FALSE;
    }
    if is_error {
        tracing::error!(id = %id, "{text}");
    } else {
        tracing::warn!(id = %id, "{text}");
    }
    log.push(ValidationMessage {
        is_error,
        id: id.into_owned(),
        text: text.into_owned(),
    });
    vk::FALSE
}
