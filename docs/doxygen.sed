# How Doxygen reads a header: the plain comment at its head describes the file, and a dot between blanks is a product, not
# the end of a sentence.
1,/^[^\/]/s|^// |/// |
1s|^/// |/// @head |
/\/\/\//s| \. | .\\ |g
