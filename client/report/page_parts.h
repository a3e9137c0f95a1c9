// The page's own style, script and stage, which the build puts into the library: report.css, report.js, stage.html.
#pragma once

#include <string_view>

namespace helio::report {

std::string_view page_style();
std::string_view page_script();
// The place in which the script shows two pictures; hidden until it does.
std::string_view page_stage();

}  // namespace helio::report
