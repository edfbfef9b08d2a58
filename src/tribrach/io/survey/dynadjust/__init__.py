"""Networks of DynAdjust, as DynaML and as DNA."""
