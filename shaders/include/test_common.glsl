// Shared by the test shaders; proves that includes resolve.
layout(buffer_reference, scalar) buffer Words { uint word[]; };
