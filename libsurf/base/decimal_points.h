// Numbers as text, whatever the user's language is.
#pragma once

#include <locale.h>

namespace surf {

/// While it lives C functions read and write numbers with a decimal point in this thread, whatever
/// sign the process has, as of Qt or Python that set the user's.
class DecimalPoints {
 public:
  DecimalPoints() : points_(::newlocale(LC_NUMERIC_MASK, "C", locale_t())) {
    if (points_ != locale_t()) before_ = ::uselocale(points_);
  }
  ~DecimalPoints() {
    if (points_ == locale_t()) return;
    ::uselocale(before_);
    ::freelocale(points_);
  }
  DecimalPoints(const DecimalPoints&) = delete;
  DecimalPoints& operator=(const DecimalPoints&) = delete;

 private:
  locale_t points_, before_ = locale_t();
};

}  // namespace surf
