// The specification of a black box by the user, and the choice of its orders where they are left open.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/blackbox/linear_model.hpp"

namespace flexspline::blackbox {

enum class Family : std::uint8_t { fir, arx };

struct Specification {
  std::string text;  // as it was written
  Family family = Family::fir;
  std::optional<Orders> orders;  // empty: chosen by held-out error
};

/// "fir:N", "fir:N,NK", "arx:NA,NB", "arx:NA,NB,NK" (NK is 1 where it is left out), "fir:auto", "arx:auto". Orders are
/// up to 200, NK from 1 to 100. Throws std::invalid_argument that quotes the text and states what is expected.
Specification parse_specification(std::string_view text);
/// The text that gives this back: "arx:4,4,1", "fir:20".
std::string text_of(const Orders& orders);

/// Orders by the RMS of free runs on data left out of the fit: by experiment where there are two or more, else by
/// thirds of the record. Of all that are within 2 % of the best one, that with the fewest parameters. ARX models that
/// are not stable do not count. Throws std::invalid_argument where there is too little data for the smallest.
Orders choose_orders(const std::vector<Record>& records, Family family);

/// The RMS by which they are chosen: infinite where a fit is not stable or not possible.
double held_out_rms(const std::vector<Record>& records, const Orders& orders);

}  // namespace flexspline::blackbox
