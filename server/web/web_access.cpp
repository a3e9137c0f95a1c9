#include "server/web/web_access.h"

#include <algorithm>

namespace helio {
namespace {

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
}

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

// Empty: this is no HOST or HOST:PORT.
std::string_view without_port(std::string_view host) {
  const std::size_t end = host.starts_with('[') ? host.find(']') : host.find(':');
  if (end == std::string_view::npos) return host.starts_with('[') ? std::string_view() : host;
  const std::size_t name = host.starts_with('[') ? end + 1 : end;
  const std::string_view port = host.substr(name);
  if (port.empty()) return host;
  const bool digits = port.size() > 1 && port.size() <= 6 && port.front() == ':' &&
                      std::all_of(port.begin() + 1, port.end(), [](char c) { return c >= '0' && c <= '9'; });
  return digits ? host.substr(0, name) : std::string_view();
}

}  // namespace

WebAccess::WebAccess(std::vector<std::string> hosts) : hosts_(std::move(hosts)) {
  hosts_.insert(hosts_.end(), {"localhost", "127.0.0.1", "[::1]"});
}

bool WebAccess::allows_host(std::string_view host) const {
  const std::string_view name = without_port(host);
  return !name.empty() &&
         std::any_of(hosts_.begin(), hosts_.end(), [&](const std::string& known) { return same_name(name, known); });
}

WebAccess::Verdict WebAccess::judge_scraper(const Scraper& scraper, const AccessTokens& tokens) const {
  const bool names_token = !tokens.empty() && !scraper.authorization.empty();
  if (names_token) return tokens.allow_header(scraper.authorization) ? Verdict::allowed : Verdict::unknown_token;
  if (scraper.local) return allows_host(scraper.host) ? Verdict::allowed : Verdict::unknown_host;
  return tokens.empty() ? Verdict::not_local : Verdict::unknown_token;
}

bool WebAccess::allows_origin(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return same_name(origin.substr(scheme.size()), host);
  }
  return false;
}

}  // namespace helio
