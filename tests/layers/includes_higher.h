#pragma once
#include "dyxel/math/rigid.h"
