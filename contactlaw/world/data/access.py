"""Records in the arrays of a world, by address: compiled code gets one record, `WORLD`, and reads all else through it.

Python owns the arrays (`world.arrays`), keeps them alive and writes their addresses into the record.
"""

from typing import Any

from contactlaw.memory import address_in, element
from contactlaw.world.data import records, tree

body_at: Any = element(records.BODY)
shape_at: Any = element(records.SHAPE)
field_at: Any = element(records.FIELD)
pair_at: Any = element(records.PAIR)
guard_at: Any = element(records.GUARD)
near_at: Any = element(records.NEAR)
near_address: Any = address_in(records.NEAR)
contact_at: Any = element(records.CONTACT)
tree_at: Any = element(tree.TREE)
world_at: Any = element(records.WORLD)
link_at: Any = element(tree.LINK)
joint_at: Any = element(tree.JOINT)
axis_at: Any = element(tree.AXIS)
limit_at: Any = element(tree.LIMIT)
row_at: Any = element(records.ROW)
coasting_at: Any = element(records.COASTING)
