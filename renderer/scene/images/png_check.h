// Whether a PNG decodes, found out without libpng: that reports what it cannot decode on stderr, where only the
// program's own lines belong, and OpenImageIO offers no way to keep it from that.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace helio {

// Empty: libpng will decode the image. Else why it will not, as a clause. Looked at is what a decoder needs: IHDR, the
// order, length and CRC-32 of the critical chunks up to the last IDAT, the palette, and the zlib stream with the filter
// of every row (PNG specification, 3rd edition, clauses 5, 7, 9 to 11); what stands behind the last IDAT is not. Takes
// the time of one inflate and 64 KiB. Precondition: `png` starts with the PNG signature.
std::string find_png_fault(std::span<const std::uint8_t> png);

}  // namespace helio
