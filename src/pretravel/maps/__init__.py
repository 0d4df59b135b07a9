"""The second shared type: pretravel over directions, and the kinds of map there are."""
