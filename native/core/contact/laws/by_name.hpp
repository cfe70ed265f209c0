// All contact laws and tangential choices, and their names. The rest of the core sees only the classes' interfaces.
#pragma once

#include "contact/laws/contact_law.hpp"
#include "contact/laws/surface_shear.hpp"

namespace mjtactile {

// The one object of a law or choice, which serves all contacts.
template <typename One>
const One& the_only() {
  static const One one;
  return one;
}

const ContactLaw& elastic_law();
const ContactLaw& foundation_law();
const ContactLaw& uniform_law();

const TangentialChoice& proportional_shear();
const TangentialChoice& stick_shear();
const TangentialChoice& coulomb_shear();

// The law or choice of a name; null if there is none.
const ContactLaw* law_named(const char* name);
const TangentialChoice* tangential_named(const char* name);

}  // namespace mjtactile
