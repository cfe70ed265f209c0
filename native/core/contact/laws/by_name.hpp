// All contact laws and tangential choices, and which of them has a name. Others know them by what they say of themselves.
#pragma once

#include "contact/laws/contact_law.hpp"
#include "contact/laws/surface_shear.hpp"

namespace mjtactile {

const ContactLaw& elastic_law();
const ContactLaw& foundation_law();
const ContactLaw& uniform_law();

const TangentialChoice& proportional_shear();
const TangentialChoice& stick_shear();
const TangentialChoice& coulomb_shear();

// Null where none has the name.
const ContactLaw* law_named(const char* name);
const TangentialChoice* tangential_named(const char* name);

}  // namespace mjtactile
