#pragma once

#include <string>

namespace vrpipe {

// Names of files, options and properties may hold any bytes; messages, reports and JSON may not. What is escaped reads
// as in C; backslashes of the text itself stay as they are.

/// Valid UTF-8, as JSON and HTML need: each byte that is no part of it becomes e.g. `\xE9`.
std::string valid_utf8(const std::string& text);

/// Valid UTF-8 on one line that moves no cursor: control characters become `\n`, `\t`, `\r` or e.g. `\x1B` too.
std::string printable(const std::string& text);

}  // namespace vrpipe
