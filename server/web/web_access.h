// Which requests of browsers are meant for this daemon: a page from elsewhere must not reach it through a user's
// browser (cross-site WebSockets, DNS rebinding).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/base/access_tokens.h"

namespace helio {

class WebAccess {
 public:
  // Names beside localhost, 127.0.0.1 and [::1] that the daemon may be called by, without ports.
  explicit WebAccess(std::vector<std::string> hosts);

  // A request's header Host: one of the names, whatever the port, which a tunnel may change.
  bool allows_host(std::string_view host) const;
  // A header Origin: http or https of exactly that Host.
  static bool allows_origin(std::string_view origin, std::string_view host);

  // Who asks for /metrics.
  struct Scraper {
    bool local = false;              // from an address of loopback, and not passed on by a proxy
    std::string_view host;           // header Host
    std::string_view authorization;  // header Authorization; empty: none
  };
  enum class Verdict { allowed, unknown_token, unknown_host, not_local };
  // Whoever names a token of the daemon may, by whatever name the daemon is known to him; without one, programs of this
  // machine, by a name that allows_host() knows: a page from elsewhere could reach the daemon by another.
  Verdict judge_scraper(const Scraper& scraper, const AccessTokens& tokens) const;

 private:
  std::vector<std::string> hosts_;
};

}  // namespace helio
