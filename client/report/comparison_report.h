// The report of a comparison of sampling modes: one HTML file that needs neither network nor script.
#pragma once

#include <filesystem>
#include <string>

#include "heliograph/v1/compare.pb.h"

namespace helio {

// The page, UTF-8. `folder` holds the pictures that the record names, relative to it (CompareRecord.Picture.file); they
// are made part of the page, reduced or fewer where it would grow beyond some 20 MB, and the page says so. What is
// missing or cannot be read is left out, with a sentence in its place: any record gives a page. All text of the record
// is escaped.
//
// The page's policy (Content-Security-Policy) allows nothing to be loaded and no other script or style than its own.
std::string comparison_report(const heliograph::v1::CompareRecord& record, const std::filesystem::path& folder);

}  // namespace helio
