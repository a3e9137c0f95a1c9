// Which requests of browsers are meant for this daemon: a page from elsewhere must not reach it through a user's
// browser (cross-site WebSockets, DNS rebinding).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace helio {

class WebAccess {
 public:
  // Names beside localhost, 127.0.0.1 and [::1] that the daemon may be called by, without ports.
  explicit WebAccess(std::vector<std::string> hosts);

  // A request's header Host: one of the names, whatever the port, which a tunnel may change.
  bool allows_host(std::string_view host) const;
  // A header Origin: http or https of exactly that Host.
  static bool allows_origin(std::string_view origin, std::string_view host);

 private:
  std::vector<std::string> hosts_;
};

}  // namespace helio
