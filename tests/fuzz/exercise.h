#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "formats/scene_format.h"

namespace vrpipe::testing {

/// A file of a format, made from any bytes. Its last byte decides on choices and, of SOG, nothing else. SOG's files are a zip
/// archive, or a bundle: `==> NAME` and a line's end before each file, the first of which is the one that is read.
SceneFile hostile_file(const std::string& format, const void* data, std::size_t size);

/// Reads the bytes as this format ("any": as whichever fits, under a name that the last byte chooses), looks at all that came of
/// it, and draws a little of it. Returns the error's message, empty without one. Whatever else is thrown is a fault of the reader,
/// as is a message that is longer than a user would read, or that is not one printable line: std::logic_error.
std::string exercise(const std::string& format, const void* data, std::size_t size);

}  // namespace vrpipe::testing
