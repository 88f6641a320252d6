#include "host/physics/model/signature.hpp"

#include <string_view>

#include "host/common/text/build_identity.hpp"

namespace flexspline::model {

std::string signed_by_tool(std::string text) {
  constexpr std::string_view kBegin = "# Last written by flexspline ";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t line_feed = text.find('\n', at);
    const std::size_t end = line_feed == std::string::npos ? text.size() : line_feed + 1;
    if (std::string_view(text).substr(at).starts_with(kBegin))
      text.erase(at, end - at);
    else
      at = end;
  }
  const std::string_view newline = text.find("\r\n") == std::string::npos ? "\n" : "\r\n";
  if (!text.empty() && text.back() != '\n') text += newline;
  // Without the name that it begins with.
  text += kBegin;
  text += std::string_view(flexspline::text::tool_name()).substr(std::string_view("flexspline ").size());
  text += '.';
  text += newline;
  return text;
}

}  // namespace flexspline::model
