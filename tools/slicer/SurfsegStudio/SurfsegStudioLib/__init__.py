"""What the module SurfsegStudio needs and Slicer does not give: nothing here imports Slicer."""
