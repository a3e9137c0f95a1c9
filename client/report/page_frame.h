// The frame of a page: one HTML file that needs no network.
#pragma once

#include <string>

namespace helio::report {

// A whole document. `title` is escaped here; `style` is added to the page's own; `body` is HTML, and so is `before`,
// which stands in front of <main>. `script` may be empty. The page's policy (Content-Security-Policy) allows nothing to
// be loaded and no other script or style than these.
std::string page_frame(const std::string& title, const std::string& style, const std::string& before,
                       const std::string& body, const std::string& script);

}  // namespace helio::report
