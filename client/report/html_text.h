// Text and bytes as HTML holds them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace helio::report {

// For element content and quoted attributes: &, <, >, " and ' as references. Control characters, which HTML forbids,
// become U+FFFD; line ends and tabs stay.
std::string escaped(std::string_view text);

// RFC 4648, with padding, on one line.
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace helio::report
