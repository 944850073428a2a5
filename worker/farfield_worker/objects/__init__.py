"""True impostors: one object as height fields that a shader casts rays into.

After Risser, "True Impostors", GPU Gems 3, chapter 21.
"""
